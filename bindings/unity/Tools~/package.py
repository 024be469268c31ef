"""The .meta files of the Unity package, and the native library in it.

    python3 Tools~/package.py                          compares the .meta files with the files
    python3 Tools~/package.py --write                  writes them
    python3 Tools~/package.py --library FILE PLATFORM  puts a native library into the package

GUIDs follow from the paths, so that they are the same on every machine. Folders that end with ~ are
hidden from Unity. Those of samples are copied into projects, so that their files have GUIDs too.
"""

from __future__ import annotations

import hashlib
import shutil
import sys
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent
NAME = "com.unic.garments"
# Folder under Runtime/Plugins, operating system in the editor, player, processor in both.
PLATFORMS = {
    "linux-x86_64": ("Linux/x86_64", "Linux", "Linux64", "x86_64"),
    "windows-x86_64": ("Windows/x86_64", "Windows", "Win64", "x86_64"),
    "macos-arm64": ("macOS/arm64", "OSX", "OSXUniversal", "ARM64"),
    "macos-x86_64": ("macOS/x86_64", "OSX", "OSXUniversal", "x86_64"),
    "android-arm64": ("Android/arm64-v8a", None, "Android", "ARM64"),
    "ios": ("iOS", None, "iOS", "AnyCPU"),
}
TAIL = """  externalObjects: {}
  userData:
  assetBundleName:
  assetBundleVariant:
"""


def importer(path: Path) -> str:
    """The importer of a file or folder, with its settings."""
    if path.is_dir():
        return "folderAsset: yes\nDefaultImporter:\n" + TAIL
    if path.name == "package.json":
        return "PackageManifestImporter:\n" + TAIL
    if path.suffix == ".cs":
        return ("MonoImporter:\n  externalObjects: {}\n  serializedVersion: 2\n  defaultReferences: []\n"
                "  executionOrder: 0\n  icon: {instanceID: 0}\n" + TAIL.split("\n", 1)[1])
    kind = {".asmdef": "AssemblyDefinitionImporter", ".md": "TextScriptImporter"}.get(path.suffix, "DefaultImporter")
    return f"{kind}:\n" + TAIL


def guid(path: Path) -> str:
    """The GUID of a file or folder: it follows from the path in the package."""
    return hashlib.md5(f"{NAME}/{path.relative_to(PACKAGE).as_posix()}".encode()).hexdigest()


def meta(path: Path) -> str:
    """The text of the .meta file of a file or folder."""
    return f"fileFormatVersion: 2\nguid: {guid(path)}\n{importer(path)}"


def assets(folder: Path):
    """Files and folders that have a .meta file."""
    for path in sorted(folder.iterdir()):
        hidden = path.name.startswith(".") or path.name.endswith("~")
        if path.name == "Samples~":
            for sample in sorted(path.iterdir()):
                yield from assets(sample)
        if hidden or path.suffix == ".meta" or path.is_relative_to(PACKAGE / "Runtime" / "Plugins"):
            continue
        yield path
        if path.is_dir():
            yield from assets(path)


def beside(path: Path) -> Path:
    """The path of a .meta file."""
    return path.with_name(path.name + ".meta")


def faults():
    """What is wrong with the .meta files."""
    expected = {beside(path): meta(path) for path in assets(PACKAGE)}
    for path, text in expected.items():
        if not path.exists() or path.read_text() != text:
            yield f"{path}: expected another text; run Tools~/package.py --write"
    plugins = PACKAGE / "Runtime" / "Plugins"
    for path in PACKAGE.rglob("*.meta"):
        if path not in expected and path != beside(plugins) and not path.is_relative_to(plugins):
            yield f"{path}: expected a file or folder beside it, found none"


def plugin_meta(path: Path, system: str | None, player: str, processor: str) -> str:
    """The text of the .meta file of a native library for one platform."""
    editor = int(system is not None)
    group = {"Android": "Android: Android", "iOS": "iPhone: iOS"}.get(player, f"Standalone: {player}")
    return f"""fileFormatVersion: 2
guid: {guid(path)}
PluginImporter:
  externalObjects: {{}}
  serializedVersion: 2
  iconMap: {{}}
  executionOrder: {{}}
  defineConstraints: []
  isPreloaded: 0
  isOverridable: 0
  isExplicitlyReferenced: 0
  validateReferences: 1
  platformData:
  - first:
      Any:
    second:
      enabled: 0
      settings: {{}}
  - first:
      Editor: Editor
    second:
      enabled: {editor}
      settings:
        CPU: {processor}
        DefaultValueInitialized: true
        OS: {system or "AnyOS"}
  - first:
      {group}
    second:
      enabled: 1
      settings:
        CPU: {processor}
{TAIL.split(chr(10), 1)[1]}"""


def put_library(library: Path, platform: str) -> Path:
    """Copies a native library into the package, with the .meta files of it and its folders."""
    folder, system, player, processor = PLATFORMS[platform]
    to = PACKAGE / "Runtime" / "Plugins" / folder / library.name
    to.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(library, to)
    beside(to).write_text(plugin_meta(to, system, player, processor))
    for parent in to.parents:
        if parent == PACKAGE / "Runtime":
            break
        beside(parent).write_text(meta(parent))
    return to


def main(arguments: list[str]) -> int:
    if arguments[:1] == ["--library"]:
        if len(arguments) != 3 or arguments[2] not in PLATFORMS:
            print(f"expected --library FILE PLATFORM, with one of {', '.join(PLATFORMS)}")
            return 2
        print(put_library(Path(arguments[1]), arguments[2]))
        return 0
    if arguments == ["--write"]:
        # Those of native libraries come with --library.
        for path in PACKAGE.rglob("*.meta"):
            if "Plugins" not in path.relative_to(PACKAGE).as_posix():
                path.unlink()
        for path in assets(PACKAGE):
            beside(path).write_text(meta(path))
    found = list(faults())
    print("\n".join(found) or f"package: {len(list(assets(PACKAGE)))} .meta files")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
