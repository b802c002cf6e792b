from typing import Any, Callable, List, Optional, Tuple

Given = Tuple[str, bytes, bytes, Tuple[bool, float], str]
ModelGiven = Tuple[
    str,
    float,
    bytes,
    List[str],
    Tuple[
        Callable[[], List[bytes]],
        Callable[[bytes], bytes],
        Callable[[bytes, bytes], bytes],
        Callable[[bytes, bytes], bytes],
    ],
]
Answered = Tuple[
    str,
    str,
    Tuple[
        Callable[[], Optional[Given]],
        Callable[[], List[ModelGiven]],
        Callable[[], List[Tuple[str, str]]],
    ],
    List[str],
]

__version__: str

class YawrigError(ValueError):
    exit_code: int

def ask(
    verb: str,
    arguments: List[str],
    records: List[Given],
    progress: Optional[Callable[[int, int], Any]],
) -> Answered: ...
def read(path: str, selection: str) -> Given: ...
def said(selection: str) -> Tuple[str, float]: ...
def of_table(name: str, columns: List[Tuple[str, Optional[str], bytes]], selection: str) -> Given: ...
def releases(of: Given) -> List[Given]: ...
