"""Files of other programs, told by their first bytes, and what makes of each a file that can be imported."""

import struct
from pathlib import Path

_LOOK = 4096  # bytes
_TABLE = "import pandas; pandas.{reader}('{file}'){more}.to_csv('{stem}.csv', index=False)"
_ARCHIVES = (
    (b"PK\x03\x04", "a zip"), (b"\x1f\x8b", "a gzip"), (b"BZh", "a bzip2"), (b"\xfd7zXZ\0", "an xz"),
    (b"\x28\xb5\x2f\xfd", "a zstd"), (b"7z\xbc\xaf\x27\x1c", "a 7z"), (b"Rar!", "a rar"),
)  # fmt: skip
_WAVE = (
    "import scipy.io.wavfile, numpy; _, d = scipy.io.wavfile.read('{file}'); "
    "numpy.savetxt('{stem}.csv', d.reshape(len(d), -1), delimiter=',')"
)
_RAW = "import numpy; numpy.savetxt('{stem}.csv', numpy.fromfile('{file}', dtype='<f4').reshape(-1, 1), delimiter=',')"
_NUMPY = "import numpy; d = numpy.load('{file}'); numpy.savetxt('{stem}.csv', d.reshape(len(d), -1), delimiter=',')"


def other_container(path: Path) -> str | None:
    """What the file is and how to go on, for a message; None where it may be text or a format that is read.

    Parameters
    ----------
    path : a file that can be read.
    """
    with path.open("rb") as file:
        head = file.read(_LOOK)
    names = {"file": path.name, "stem": path.stem}
    if head.startswith(b"PK\x03\x04") and (b"[Content_Types].xml" in head or b"mimetype" in head[:60]):
        return "is a spreadsheet (xlsx, ods); open it and save its sheet as CSV ('Save as', 'CSV UTF-8')"
    if head.startswith(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"):
        return "is an old spreadsheet (xls); open it and save its sheet as CSV ('Save as', 'CSV UTF-8')"
    for mark, name in _ARCHIVES:
        if head.startswith(mark):
            return f"is an archive; unpack it and import the file inside ({name} file)"
    if head.startswith(b"RIFF") and head[8:12] == b"WAVE":
        return (
            f"is sound (WAV){_sound_rate(head)}; write it as text: {_python(_WAVE, names)}, and read that by "
            "'column: 1' and 'time: {kind: rows}'"
        )
    if head.startswith(b"\x93NUMPY"):
        return f"is an array of NumPy; write it as text: {_python(_NUMPY, names)}"
    if head.startswith(b"ARROW1"):
        arrow = _TABLE.replace("{reader}", "read_feather").replace("{more}", "")
        return f"is a Feather file (Arrow); write it as text: {_python(arrow, names)}"
    return _without_cure(head, names)


def _without_cure(head: bytes, names: dict[str, str]) -> str | None:
    export = "export it as CSV, TDMS, MDF or Parquet"
    if head.startswith((b"|CF,", b"|CK,")):
        return f"is an imc FAMOS file; {export} with imc FAMOS or imc STUDIO"
    if head.startswith(b"SQLite format 3\0"):
        return (
            "is a SQLite database; export the table as CSV: sqlite3 -header -csv FILE 'select * from TABLE' > data.csv"
        )
    if head.startswith(b"# Created by Octave"):
        return f"is a text file of Octave; save it there by save('-v7', '{names['stem']}.mat', 'NAME', ...)"
    if head.startswith(b"LOGG"):
        return "is a CAN log (BLF); decode it with its data base and export it as MDF 4 or CSV"
    if head[8:12] == b".FIT":
        return "is a FIT file; export it as CSV with the program of its device"
    if head.startswith(b"%PDF"):
        return "is a PDF; ask for the numbers as CSV"
    if head.lstrip(b"\xef\xbb\xbf \r\n\t")[:1] == b"<" and b">" in head:
        kind = "TDM (DIAdem)" if b"<usi:tdm" in head else "XML or HTML"
        return f"is {kind}, no table; {export}"
    if head.lstrip(b"\xef\xbb\xbf \r\n\t")[:1] in (b"{", b"["):
        reader = _TABLE.replace("{reader}", "read_json").replace("{more}", "")
        return f"is JSON, no table; where it is a list of rows, write it as text: {_python(reader, names)}"
    if _is_binary(head):
        return (
            "holds zero bytes or control characters, it is no text and no format that railsim knows; "
            f"{export} with the logger's software, or, where it holds nothing but 32-bit numbers, write them as text: "
            f"{_python(_RAW, names)}"
        )
    return None


def _is_binary(head: bytes) -> bool:
    """Whether a file's beginning is neither text nor UTF-16; zeros behind the last line do not count."""
    kept = head.rstrip(b"\0")
    if kept.startswith((b"\xff\xfe", b"\xfe\xff")) or len(kept) < 4:
        return False
    zeros = kept.count(0)
    even, odd = kept[::2].count(0), kept[1::2].count(0)
    if zeros > 0.3 * len(kept) and min(even, odd) < 0.1 * zeros:
        text = kept[1::2] if even > odd else kept[::2]
        return _share_of_controls(text) > 0.1
    return _share_of_controls(kept.replace(b"\0", b"")) > 0.1 or zeros > 0.3 * len(kept)


def _share_of_controls(data: bytes) -> float:
    return sum(byte < 9 or 14 <= byte < 32 for byte in data) / max(1, len(data))


def _sound_rate(head: bytes) -> str:
    return f" at {struct.unpack_from('<I', head, 24)[0]} Hz" if len(head) > 28 else ""


def _python(code: str, names: dict[str, str]) -> str:
    """The command that runs a line of Python on the file."""
    return f'python -c "{code.format(**names)}"'
