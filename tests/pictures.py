"""A study of tiny pictures beside its file, so that nothing needs to be rendered."""

import struct
import zlib
from pathlib import Path

import yaml

TEXTS = ("welcome", "consent", "instructions", "debrief")


def png(number: int) -> bytes:
    """Return a picture of two points that differs from those of all other numbers."""
    row = b"\0" + number.to_bytes(3, "big") + b"\x40\x80\xc0"

    def chunk(kind: bytes, content: bytes) -> bytes:
        check = zlib.crc32(kind + content)
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)

    header = struct.pack(">IIBBBBB", 2, 1, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(row)) + chunk(b"IEND", b"")


def write_study(folder: Path, slug: str, *, pictures: int, part: dict[str, object], **fields: object) -> Path:
    """Write pictures and a study file of one part that shows them; return the file."""
    (folder / "faces").mkdir(parents=True)
    for number in range(pictures):
        (folder / "faces" / f"{number}.png").write_bytes(png(number))
    study = {
        "slug": slug,
        "title": {"en": "Pictures"},
        "languages": ["en"],
        "seed": 11,
        **{name: {"en": [f"The text {name}."]} for name in TEXTS},
        "conditions": [{"name": "only", "label": {"en": "Only"}}],
        "stimuli": [
            {"id": f"face{number}", "label": {"en": f"Face {number}"}, "media": f"faces/{number}.png"}
            for number in range(pictures)
        ],
        "parts": [
            {"name": "rating", "instruments": ["pad5"], "presentation": {"assignment": "full"}, **part},
        ],
        **fields,
    }
    path = folder / f"{slug}.yaml"
    path.write_text(yaml.safe_dump(study, sort_keys=False, allow_unicode=True), encoding="utf-8")
    return path
