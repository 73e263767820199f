"""The companion process of ``padlab serve``: renders clips that are or become pending.

Run as ``python -m webapp.cli.companion PROCESS``, where PROCESS is the number of the server's process.
"""

import sys

from webapp import farm
from webapp.config import Settings

if __name__ == "__main__":
    farm.watch(Settings.from_env(), parent=int(sys.argv[1]))
