"""What a participant saw of a clip, from the events that the player logged."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

KINDS = MappingProxyType(
    {
        "play": "playing was asked for",
        "playing": "playing began, or went on after a wait",
        "pause": "playing was paused",
        "ended": "the end was reached",
        "seeking": "a jump began; media_s is the position before it",
        "seeked": "a jump was over; media_s is the position after it",
        "stalled": "the network delivers nothing",
        "waiting": "playing stopped for want of data",
        "ratechange": "the speed changed; value is the new one, 1 as recorded",
        "hidden": "the page was hidden: another tab or window",
        "visible": "the page was seen again",
        "error": "playing failed",
        "frames": "value is the number of frames dropped so far",
        "duration": "value is the length of the clip in seconds",
    }
)
"""Kinds of events, and what they say; any of them may tell the position in the clip besides."""

FASTER = 1.1
"""How much faster than page time and speed allow a clip may seem to play: clocks differ, and media clocks round."""
SLACK_S = 0.25
"""Seconds that positions may be off, since browsers report them a little late or early."""

# Browsers play from 1/16 to 16 times as fast.
_SLOWEST, _FASTEST = 0.0625, 16.0
_COMPLETE_SHARE = 0.05


@dataclass(frozen=True, slots=True)
class PlayEvent:
    """One event of the player.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    page_ms : float
        Milliseconds since the page was shown, by the page's steady clock, 0 or more.
    media_s : float or None
        Position in the clip in seconds; None if it is not known.
    value : float or None
        What the kind says.
    """

    kind: str
    page_ms: float
    media_s: float | None
    value: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Playback:
    """What was seen of a clip.

    Attributes
    ----------
    played_s : float
        Seconds of the clip that were played at least once.
    share : float or None
        The same as a share of the duration, 0 to 1; None if the duration is not known.
    plays : int
        How often the end was reached while playing; an end that is not at the clip's end does not count.
    stalls : int
        How often playing had to wait, or the network delivered nothing; waits that a jump causes are not counted.
    stalled_s : float
        Seconds of page time that this took, less the time in which the clip went on.
    seeks : int
        How many jumps; going back from the end to the start, to play once more, is none.
    dropped_frames : int
        Frames that were not shown.
    max_rate, min_rate : float
        Fastest and slowest speed at which something was played; 1 if nothing was.
    hidden_s : float
        Seconds of page time in which the page was hidden while playing.
    complete : bool
        Whether the clip was played whole: nothing, or no more than 0.25 s and 5 % of it, is missing.
    """

    played_s: float
    share: float | None
    plays: int
    stalls: int
    stalled_s: float
    seeks: int
    dropped_frames: int
    max_rate: float
    min_rate: float
    hidden_s: float
    complete: bool


def summarise(events: Iterable[PlayEvent], *, duration_s: float | None) -> Playback:
    """Return what was seen of a clip.

    What lies between two events was played if the clip was playing and its position moved forward by no more than
    page time allows at the speed of the time: by speed x time x 1.1 + 0.25 s. The tolerances do not add up: all that is
    played may not exceed what the whole time of playing allows, with 0.25 s once. So a log in which a clip is played
    faster than it can be does not count; a log with forged page times can only be told by whoever knows when the
    trial was shown and answered.

    Parameters
    ----------
    events : iterable of PlayEvent
        The log, in any order. Events of other kinds, without a time, or with a negative one are left out, as are
        positions and values that are no numbers or make no sense.
    duration_s : float or None
        Length of the clip in seconds. If None, or no positive number, the page's own "duration" events are believed
        (the longest of them), but never less than what was played.

    Returns
    -------
    Playback
        The summary, whatever the events are.
    """
    player = _Player()
    for event in sorted((event for event in events if _usable(event)), key=_time):
        player.see(event)
    return player.summary(_number(duration_s, least=0))


def _usable(event: PlayEvent) -> bool:
    return isinstance(event.kind, str) and event.kind in KINDS and _number(event.page_ms, least=0) is not None


def _time(event: PlayEvent) -> float:
    return float(event.page_ms)


def _number(value: object, *, least: float, most: float = 1e12) -> float | None:
    """Return what is a number from `least` to `most`, or else None."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer):
        return None
    return float(value) if least <= value <= most else None


def _united(ranges: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    united: list[tuple[float, float]] = []
    for start, end in sorted(ranges):
        if united and start <= united[-1][1]:
            united[-1] = (united[-1][0], max(end, united[-1][1]))
        else:
            united.append((start, end))
    return united


class _Player:
    """The player's state, as events change it."""

    def __init__(self) -> None:
        self.now = 0.0
        self.playing = self.hidden = self.stalled = self.seeking = self.at_end = False
        self.rate = 1.0
        # Where the clip was when that was last known, the time since, and how far that time allows it to move.
        self.position: float | None = None
        self.since = self.reach = 0.0
        # What playing time in all allows to be played, and is not used up yet.
        self.allowed = SLACK_S
        self.ranges: list[tuple[float, float]] = []
        self.rates: list[float] = []
        # Positions at which an end was reported.
        self.ends: list[float | None] = []
        self.stalls = self.seeks = 0
        self.stalled_s = self.hidden_s = 0.0
        self.dropped = 0.0
        self.stated_duration: float | None = None

    def see(self, event: PlayEvent) -> None:
        seconds = event.page_ms / 1000 - self.now
        self.now += seconds
        if self.playing:
            self._pass(seconds)
        media = _number(event.media_s, least=0)
        if media is not None:
            self._move(media)
        getattr(self, f"_on_{event.kind}")(event)
        if not self.playing:
            self.position = None

    def summary(self, duration_s: float | None) -> Playback:
        ranges = _united(self.ranges)
        known = duration_s or None
        if known is None and self.stated_duration is not None:
            known = max(self.stated_duration, *(end for _, end in ranges), 0)
        if known is not None:
            ranges = [(start, min(end, known)) for start, end in ranges if start < known]
        played = math.fsum(end - start for start, end in ranges)
        if known is not None:
            played = min(played, known)
        return Playback(
            played_s=played,
            share=None if known is None else min(played / known, 1.0),
            plays=sum(known is None or (end is not None and end >= known - SLACK_S) for end in self.ends),
            stalls=self.stalls,
            stalled_s=self.stalled_s,
            seeks=self.seeks,
            dropped_frames=int(self.dropped),
            max_rate=max(self.rates, default=1.0),
            min_rate=min(self.rates, default=1.0),
            hidden_s=self.hidden_s,
            complete=known is not None and known - played <= min(SLACK_S, _COMPLETE_SHARE * known),
        )

    def _pass(self, seconds: float) -> None:
        """Let time pass while the clip is playing."""
        self.since += seconds
        self.reach += seconds * self.rate
        self.allowed += seconds * self.rate * FASTER
        if self.hidden:
            self.hidden_s += seconds

    def _move(self, media: float) -> None:
        """Note the position, and what was played on the way to it."""
        moved = media - self.position if self.playing and self.position is not None else 0.0
        plausible = 0 < moved <= min(self.reach * FASTER + SLACK_S, self.allowed) and not self.seeking
        if plausible and self.position is not None:
            self.ranges.append((self.position, media))
            self.rates.append(self.rate)
            self.allowed -= moved
        self._count_stall(moved if plausible else 0.0)
        self.position = media
        self.since = self.reach = 0.0

    def _count_stall(self, moved: float) -> None:
        if self.playing and self.stalled and not self.seeking:
            self.stalled_s += max(0.0, self.since - moved / self.rate)

    def _stop(self) -> None:
        if self.since:
            # The event has no position, so nothing says that the clip went on.
            self._count_stall(0.0)
        self.playing = self.stalled = False
        self.since = self.reach = 0.0

    def _on_play(self, _: PlayEvent) -> None:
        if not self.playing:
            self.since = self.reach = 0.0
        self.playing = True

    def _on_playing(self, event: PlayEvent) -> None:
        if self.since:
            self._count_stall(0.0)
            self.since = 0.0
        self.stalled = self.seeking = self.at_end = False
        self._on_play(event)

    def _on_pause(self, _: PlayEvent) -> None:
        self._stop()

    def _on_ended(self, event: PlayEvent) -> None:
        if self.playing:
            self.ends.append(_number(event.media_s, least=0))
        self.at_end, self.seeking = True, False
        self._stop()

    def _on_error(self, _: PlayEvent) -> None:
        self._stop()

    def _on_seeking(self, _: PlayEvent) -> None:
        self.seeks += not self.seeking
        self.seeking, self.stalled = True, False

    def _on_seeked(self, event: PlayEvent) -> None:
        # Whatever came before the jump is not where the clip went on from.
        self.position = _number(event.media_s, least=0)
        again = self.at_end and self.position is not None and self.position <= SLACK_S
        if again:
            self.seeks -= self.seeking
        else:
            self.seeks += not self.seeking
        self.seeking = self.stalled = self.at_end = False
        self.since = self.reach = 0.0

    def _on_waiting(self, _: PlayEvent) -> None:
        if self.playing and not self.seeking:
            self.stalls += not self.stalled
            self.stalled = True
            # What passed before does not belong to the wait.
            self.since = 0.0

    def _on_stalled(self, event: PlayEvent) -> None:
        self._on_waiting(event)

    def _on_ratechange(self, event: PlayEvent) -> None:
        self.rate = _number(event.value, least=_SLOWEST, most=_FASTEST) or self.rate

    def _on_hidden(self, _: PlayEvent) -> None:
        self.hidden = True

    def _on_visible(self, _: PlayEvent) -> None:
        self.hidden = False

    def _on_frames(self, event: PlayEvent) -> None:
        self.dropped = max(self.dropped, _number(event.value, least=0) or 0.0)

    def _on_duration(self, event: PlayEvent) -> None:
        stated = _number(event.value, least=0) or None
        if stated is not None:
            self.stated_duration = max(stated, self.stated_duration or 0.0)
