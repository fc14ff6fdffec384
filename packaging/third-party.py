"""Prints the licences of the libraries that are linked into rungd: each name, version and licence,
and below them each text of theirs once."""

import hashlib
import json
import pathlib
import subprocess

host = subprocess.run(["rustc", "-vV"], capture_output=True, text=True, check=True).stdout
host = next(line.split()[1] for line in host.splitlines() if line.startswith("host:"))
meta = json.loads(subprocess.run(
    ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", host],
    capture_output=True, text=True, check=True).stdout)
packages = {package["id"]: package for package in meta["packages"]}
nodes = {node["id"]: node for node in meta["resolve"]["nodes"]}

found, todo = set(), [meta["resolve"]["root"]]
while todo:
    for dep in nodes[todo.pop()]["deps"]:
        linked = any(kind["kind"] is None for kind in dep["dep_kinds"])
        if linked and dep["pkg"] not in found:
            found.add(dep["pkg"])
            todo.append(dep["pkg"])

texts = {}
print("Libraries in rungd, under the licences named; their texts follow.\n")
for package in sorted((packages[id] for id in found), key=lambda package: package["name"]):
    print(f'{package["name"]} {package["version"]}: {package["license"]}')
    folder = pathlib.Path(package["manifest_path"]).parent
    for path in sorted(folder.iterdir()):
        if path.is_file() and path.name.upper().startswith(("LICEN", "COPYING", "NOTICE", "COPYRIGHT")):
            text = path.read_text(encoding="utf-8", errors="replace").strip()
            key = hashlib.sha256(" ".join(text.split()).encode()).digest()
            texts.setdefault(key, (text, []))[1].append(f'{package["name"]} ({path.name})')
for text, owners in texts.values():
    print(f'\n{"-" * 78}\n{", ".join(owners)}\n\n{text}')
