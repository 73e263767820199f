"""Head motion by prosodic words: Eq. 1 and Eq. 2 of MTAP 2013, features of recordings, rotation from facial points."""
