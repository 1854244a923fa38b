"""Minimal importer of an FMU: reads the archive, and calls the binary through ctypes."""

import ctypes
import io
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np

OK, WARNING, _DISCARD, ERROR = range(4)
LOG = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
NUMBER, REFERENCE = ctypes.c_double, ctypes.c_uint32


class Importer:
    """Instance of an FMU.

    Parameters
    ----------
    content
        Content of the FMU's file.
    folder
        Folder for the unpacked binary.
    token
        Instantiation token; default: that of the FMU.
    """

    def __init__(self, content: bytes, folder: Path, token: str | None = None) -> None:
        archive = zipfile.ZipFile(io.BytesIO(content))
        root = Xml.fromstring(archive.read("modelDescription.xml"))
        self.variables = {
            each.attrib["name"]: each.attrib
            for listed in root.iter("ModelVariables")
            for each in listed
        }
        (binary,) = (name for name in archive.namelist() if name.startswith("binaries/"))
        self.library = ctypes.CDLL(archive.extract(binary, folder))
        self.said: list[tuple[int, str]] = []
        self._log = LOG(lambda _, status, __, text: self.said.append((status, text.decode())))
        make = self.library.fmi3InstantiateCoSimulation
        make.restype = ctypes.c_void_p
        token = root.attrib["instantiationToken"] if token is None else token
        flags = [ctypes.c_bool(False)] * 4
        self.me = make(
            *(b"a drive", token.encode(), None, *flags),
            *(None, ctypes.c_size_t(0), None, self._log, None),
        )

    def call(self, name: str, *arguments: Any) -> int:
        """Call a function of FMI and return its status."""
        given = [NUMBER(x) if isinstance(x, float) else x for x in arguments]
        found: int = getattr(self.library, f"fmi3{name}")(ctypes.c_void_p(self.me), *given)
        return found

    def start(self, at: float = 0.0, **values: float | bool) -> int:
        """Set variables and initialise at a time [s]; return the status of the last call."""
        for name, value in values.items():
            assert self.set(name, value) == OK
        begun = ctypes.c_bool(False), 0.0, at, ctypes.c_bool(False), 0.0
        assert self.call("EnterInitializationMode", *begun) == OK
        return self.call("ExitInitializationMode")

    def reference(self, name: str) -> Any:
        """Return the value reference of a variable, as an array."""
        return (REFERENCE * 1)(int(self.variables[name]["valueReference"]))

    def set(self, name: str, value: float | bool) -> int:
        """Set a variable and return the status."""
        kind = ("Boolean", ctypes.c_bool) if isinstance(value, bool) else ("Float64", NUMBER)
        one = ctypes.c_size_t(1)
        return self.call(f"Set{kind[0]}", self.reference(name), one, (kind[1] * 1)(value), one)

    def get(self, *names: str) -> np.ndarray:
        """Return the values of variables."""
        count = ctypes.c_size_t(len(names))
        references = (REFERENCE * len(names))(
            *(int(self.variables[name]["valueReference"]) for name in names)
        )
        values = (NUMBER * len(names))()
        assert self.call("GetFloat64", references, count, values, count) == OK
        return np.array(values)

    def step(self, now: float, size: float) -> int:
        """Take a communication step from ``now`` of ``size`` [s]; return the status."""
        flags, self.last = [ctypes.c_bool() for _ in range(3)], NUMBER()
        pointers = [ctypes.byref(each) for each in (*flags, self.last)]
        return self.call("DoStep", now, size, ctypes.c_bool(True), *pointers)

    def keep(self) -> ctypes.c_void_p:
        """Return the FMU's state after a round trip through its serialized form."""
        kept, other, size = ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_size_t()
        assert self.call("GetFMUState", ctypes.byref(kept)) == OK
        assert self.call("SerializedFMUStateSize", kept, ctypes.byref(size)) == OK
        content = (ctypes.c_uint8 * size.value)()
        assert self.call("SerializeFMUState", kept, content, size) == OK
        assert self.call("FreeFMUState", ctypes.byref(kept)) == OK and not kept
        assert self.call("DeserializeFMUState", content, size, ctypes.byref(other)) == OK
        return other
