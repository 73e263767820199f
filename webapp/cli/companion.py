"""The companion process of ``padlab serve``: renders clips that are or become pending."""

from webapp import farm
from webapp.config import Settings

if __name__ == "__main__":
    farm.watch(Settings.from_env())
