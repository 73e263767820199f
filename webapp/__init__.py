"""padlab's web application: participants' pages, the experimenter's pages and the command line."""
