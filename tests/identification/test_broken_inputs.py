"""Recordings that cannot be used: one clear message each, before anything is fitted."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

import ab_sim
from ab_sim.base.errors import AbSimError, InputError
from ab_sim.design.sweep import open_sweep
from ab_sim.identification.tables import read_table
from tests.identification import drives

Break = Callable[[dict[str, Any]], Any]


def edited(column: str, change: Callable[[np.ndarray], np.ndarray]) -> Break:
    def edit(table: dict[str, Any]) -> None:
        table[column] = change(table[column].astype(object))

    return edit


def set_at(column: str, rows: Any, value: Any) -> Break:
    def edit(table: dict[str, Any]) -> None:
        table[column] = table[column].astype(object)
        table[column][rows] = value

    return edit


def cut(rows: Any) -> Break:
    def edit(table: dict[str, Any]) -> None:
        for name, column in table.items():
            table[name] = np.delete(column, rows)

    return edit


def two_drives(table: dict[str, Any]) -> None:
    for name, column in table.items():
        table[name] = np.concatenate([column, column])


def two_drives_interleaved(table: dict[str, Any]) -> None:
    for name, column in table.items():
        table[name] = np.repeat(column, 2)


def swapped(table: dict[str, Any]) -> None:
    table["ch1"], table["ch2"] = table["ch2"], table["ch1"]


def short(table: dict[str, Any]) -> None:
    for name, column in table.items():
        table[name] = column[:30]


def clipped(table: dict[str, Any]) -> None:
    most = 0.4 * np.max(np.abs(table["ch1"]))
    table["ch1"] = np.clip(table["ch1"], -most, most)


def too_slow(table: dict[str, Any]) -> None:
    for name, column in table.items():
        table[name] = column[::12]


TABLES: list[tuple[str, Break, str]] = [
    ("gap", cut(slice(800, 1100)), "time: no samples for 0.301 s after 0.799 s"),
    ("no time", set_at("t", 700, np.nan), "time: row 700 is not a finite number"),
    ("time goes back", edited("t", lambda t: np.concatenate([t[:500], t[400:-100]])), "goes back"),
    ("two runs in one file", two_drives, "goes back at row 2001.*two drives or two runs"),
    ("two drives in one file", two_drives_interleaved, "at row 1, .*two drives in one file"),
    ("time never changes", edited("t", lambda t: 0 * t), "time: never changes"),
    ("time in the wrong unit", edited("t", lambda t: 1000 * t), "samples in a turn; must be"),
    ("sampled too slowly", too_slow, "samples in a turn; must be at least 4"),
    ("wrong clock", edited("t", lambda t: 2.0 * t), "angle grows 0.5 times as much as its speed"),
    ("no speed", set_at("rpm", slice(900, 910), np.nan), "speed: row 900 is not a finite number"),
    ("spindle stands", edited("rpm", lambda w: 0 * w), "the spindle makes 0 turns"),
    ("angle lost", set_at("encoder", 5, np.inf), "angle: row .* is not a finite number"),
    ("missing signal", set_at("ch1", slice(0, 400), np.nan), "signals.0 .ch1.: 400 of 2001 sam"),
    ("infinite signal", set_at("ch2", slice(0, 400), np.inf), "signals.1 .ch2.: 400 of 2001 sam"),
    ("constant", edited("ch2", lambda y: 0 * y + 0.3), r"\(ch2\): is 0.0003 all the time"),
    ("clipped", clipped, "is clipped: it stays at"),
    ("swapped axes", swapped, "whirls against the spindle; are the signals' axes swapped"),
    ("reversed axis", edited("ch2", lambda y: -y), "whirls against the spindle"),
    ("wrong unit", edited("ch1", lambda y: 1e6 * y), "times what the scene bench gives"),
    ("text in a column", set_at("ch1", 3, "over"), "the column 'ch1' holds texts"),
    ("missing column", lambda table: table.pop("ch2"), "signals.1: there is no column 'ch2'"),
    ("too short", short, "has 30 samples; must be at least 50"),
]  # fmt: skip
MAPS = [
    ("speed in the wrong unit", drives.MAP.replace("rpm, unit: rpm", "rpm, unit: rad/s")
     .replace("angle: {column: encoder, unit: deg}", ""), "samples in a turn|times the spindle's"),
    ("unit of something else", drives.MAP.replace("ch1, unit: mm", "ch1, unit: V"),
     "neither of a displacement nor|unit 'V'"),
    ("no unit", drives.MAP.replace(", unit: mm", ""), "has no unit; give it"),
    ("unknown key", drives.MAP + "sampel: 3\n", "sampel: there is no such key; did you mean"),
    ("time twice", drives.MAP + "sampling: 1 kHz\n", "exactly one of time .* and sampling"),
    ("no spindle", "time: {column: t}\nsignals: [{column: ch1, unit: mm}]\n", "angle or keyphasor"),
    ("no YAML", "time: {column: [", "is not valid YAML"),
    ("no signals", "time: {column: t}\nspeed: {column: rpm}\nsignals: []\n", "signals"),
    ("wrong rate", drives.MAP.replace("time: {column: t, unit: s}", "sampling: 500 Hz"),
     "angle grows 0.5 times as much"),
    ("wrong rate, no angle", drives.MAP.replace("time: {column: t, unit: s}", "sampling: 500 Hz")
     .replace("angle: {column: encoder, unit: deg}", "balls: false"),
     "follows 0.4.* times the spindle's speed"),
    ("no rate", drives.MAP.replace("time: {column: t, unit: s}", "sampling: 0 Hz"), "more than 0"),
    ("unknown sensor", drives.MAP + "sensor: pickup\n", "sensor = 'pickup': no such sensor; the s"),
    ("sensor's own wrong key", drives.MAP + "sensor: {bandwith: 200}\n",
     "sensor.bandwith = 200: .*did you mean 'bandwidth'"),
    ("what cannot be free", drives.MAP + "free: [phase]\n", "free.0 = 'phase'"),
]  # fmt: skip


def message(folder: Path, table: dict[str, Any], text: str = drives.MAP) -> str:
    """What an identification of such a recording says; it must be one line."""
    file = drives.write(table, folder / "bench.csv")
    with pytest.raises(AbSimError) as caught:
        ab_sim.identify(
            file, drives.scene(), ["rotor.eccentricity"], maps=[drives.mapping(folder, text)]
        )
    said = str(caught.value)
    assert "\n" not in said and isinstance(caught.value, InputError)
    return said


@pytest.mark.parametrize(("spoil", "says"), [case[1:] for case in TABLES],
                         ids=[case[0] for case in TABLES])  # fmt: skip
def test_a_spoilt_table(tmp_path: Path, spoil: Break, says: str) -> None:
    table: dict[str, Any] = drives.recorded(drives.scene())
    spoil(table)
    said = message(tmp_path, table)
    assert re.search(says, said), said
    assert said.startswith("bench: ")


@pytest.mark.parametrize(("text", "says"), [case[1:] for case in MAPS],
                         ids=[case[0] for case in MAPS])  # fmt: skip
def test_a_wrong_mapping(tmp_path: Path, text: str, says: str) -> None:
    said = message(tmp_path, drives.recorded(drives.scene()), text)
    assert re.search(says, said), said


def test_a_small_parquet_of_many_rows_is_refused_by_its_head(tmp_path: Path) -> None:
    """Runs of one value take next to nothing in a file; its stated rows are looked at first."""
    path = tmp_path / "many.parquet"
    ones = pa.DictionaryArray.from_arrays(pa.array(np.zeros(1 << 20, np.int8)), pa.array([1.0]))
    schema = pa.schema([("t [s]", pa.float64()), ("x [mm]", pa.float64())])
    with parquet.ParquetWriter(path, schema) as file:
        for _ in range(3):
            file.write_table(pa.table([ones.dictionary_decode()] * 2, schema=schema))
    assert path.stat().st_size < 50_000
    before = pa.total_allocated_bytes()
    with pytest.raises(InputError, match="has 3145728 rows; .* 1000000"):
        read_table(path)
    assert pa.total_allocated_bytes() - before < 1 << 20
    with pytest.raises(InputError, match="not a Parquet file"):
        open_sweep(path)
