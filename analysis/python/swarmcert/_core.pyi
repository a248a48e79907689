from typing import Any, Callable, Dict, List, Optional, TypedDict

version: str

class _Done(TypedDict):
    code: int
    result: str
    certificate: str
    notes: List[str]

def run(
    words: List[str],
    network: Optional[Dict[str, Any]] = None,
    certificate: Optional[str] = None,
    progress: Optional[Callable[[int, int, str], None]] = None,
) -> _Done: ...
def options() -> Dict[str, Dict[str, bool]]: ...
def read_log(path: str, columns: str = "") -> Dict[str, Any]: ...
def residuals(
    words: List[str], fleet: str = "", columns: str = "", network: str = ""
) -> List[Dict[str, Any]]: ...
def save_network(source: Dict[str, Any], folder: str, overwrite: bool) -> str: ...
def bundled_files_beside(folder: str) -> None: ...
