"""Whether what the JSON of a glTF file claims is in its bytes, and is read: asked before any of it is decoded."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.json_file import numbers, shown
from rgspipe.datasets.mesh.links import GLB_HEADER, Links, gltf_content
from rgspipe.datasets.mesh.texture import check_texture
from rgspipe.datasets.reading_limits import RAISE, reading_limits
from rgspipe.errors import InputError

#: Bytes of each type of number, and numbers of each entry.
NUMBER_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
NUMBERS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}

#: Entries of one array, and of all of them, for each triangle that a mesh may have: three corners, and five numbers or
#: vectors (index, place, normal, place in the texture, colour) of each.
ONE, ALL = 3, 15

#: Types of numbers and entries of what is read of a primitive: places as floats, not as shares of something.
READ_AS = {
    "indices": ((5121, 5123, 5125), ("SCALAR",)),
    "POSITION": ((5126,), ("VEC3",)),
    "TEXCOORD_0": ((5126,), ("VEC2",)),
    "COLOR_0": ((5121, 5123, 5126), ("VEC3", "VEC4")),
}

#: Kinds of primitives that are read, or have no triangles: points, lines, triangles and strips of them. No fans.
MODES = range(6)

#: Extensions without which a file is read rightly, by what their names begin with: gloss, lamps, copies of nodes in
#: other extensions' words. Compressed geometry, quantised places and turned textures are none.
HARMLESS = ("KHR_materials_", "KHR_lights_", "KHR_xmp", "MSFT_lod")

#: Extensions that change what is read, wherever they stand.
UNREAD = (
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_texture_transform",
    "EXT_mesh_gpu_instancing",
    "KHR_materials_pbrSpecularGlossiness",
)

PLAIN = "Export it without compression and without extensions, as GLB."


def check_gltf(path: Path, links: Links) -> None:
    """Refuse a glTF file or GLB that claims what it has not, or has what would be read wrongly.

    Raises:
        InputError: names the file, and the part of its JSON.
    """
    content = gltf_content(path)
    if isinstance(content, dict):
        _Check(path, content, links).all()


@dataclass(frozen=True)
class _Check:
    path: Path
    content: dict
    links: Links

    def all(self) -> None:
        self._extensions()
        if not str(self._object(self.content, "asset", "").get("version", "")).startswith("2."):
            self._refuse(
                "asset.version", "2.0, or a later one that begins with 2", shown(self.content.get("asset")), PLAIN
            )
        buffers = list(self._buffers())
        views = [self._view(*part, buffers) for part in self._parts("bufferViews")]
        self._accessors(views)
        for where, mesh in self._parts("meshes"):
            for number, primitive in enumerate(self._listed(mesh, "primitives", where)):
                self._primitive(primitive, f"{where}.primitives[{number}]")
        self._images(buffers)
        for where, node in self._parts("nodes"):
            if "mesh" in node:
                self._still(node, where)
        self._tree()

    def _extensions(self) -> None:
        needed = self.content.get("extensionsRequired", [])
        needed = needed if isinstance(needed, list) else [needed]
        used = self.content.get("extensionsUsed", [])
        unread = [one for one in needed if one in UNREAD or not (isinstance(one, str) and one.startswith(HARMLESS))]
        unread += [one for one in UNREAD if isinstance(used, list) and one in used]
        if unread:
            self._refuse("extensionsUsed", "a file without such extensions", shown(unread[0]), PLAIN)

    def _buffers(self) -> Iterator[bytes | Path | slice]:
        """Where the bytes of each buffer are: in the JSON, in a file, or from here to there in the GLB itself."""
        files = self.links.buffers
        for where, buffer in self._parts("buffers"):
            uri = buffer.get("uri")
            if uri is None:
                begin = GLB_HEADER + int.from_bytes(self._read(slice(12, 16)), "little")
                yield slice(begin + 8, begin + 8 + int.from_bytes(self._read(slice(begin, begin + 4)), "little"))
            elif isinstance(uri, str) and uri in files:
                yield input_file(files[uri], "a buffer of a mesh", most_bytes=reading_limits().bytes)
            else:
                yield self._decoded(uri, where)

    def _decoded(self, uri: object, where: str) -> bytes:
        """The bytes in an address that holds them."""
        head, _, data = uri.partition("base64,") if isinstance(uri, str) else ("", "", "")
        try:
            if not head.startswith("data:"):
                raise ValueError("no address of data")
            return base64.b64decode(data, validate=True)
        except (ValueError, binascii.Error) as error:
            self._refuse(f"{where}.uri", "a file's name, or bytes in base64", f"{shown(uri)} ({error})", PLAIN)

    def _view(self, where: str, view: dict, buffers: list[bytes | Path | slice]) -> tuple[int, int, int, int]:
        """The buffer of a part of it, its begin, its length, and the bytes from entry to entry, if any are said."""
        buffer = self._index(view, "buffer", where, len(buffers))
        start, length = self._count(view, "byteOffset", where, 0), self._count(view, "byteLength", where)
        if start + length > (have := self._size(buffers[buffer])):
            found = f"{start} + {length} bytes, where its buffer has {have}"
            self._refuse(where, "bytes that are there", found, "Copy it anew, whole.")
        return buffer, start, length, self._count(view, "byteStride", where, 0)

    def _accessors(self, views: list[tuple[int, int, int, int]]) -> None:
        entries, most = 0, reading_limits().vertices
        for where, accessor in self._parts("accessors"):
            number = NUMBER_BYTES.get(self._count(accessor, "componentType", where))
            each = NUMBERS.get(str(accessor.get("type")))
            if number is None or each is None:
                self._refuse(where, "types of numbers that glTF has", shown(accessor), PLAIN)
            count = self._count(accessor, "count", where)
            entries += count
            if count > ONE * most or entries > ALL * most:
                found, remedy = f"{max(count, entries)} entries", f"Decimate the mesh. {RAISE}"
                self._refuse(where, f"a mesh of at most {most} triangles", found, remedy)
            if "bufferView" in accessor:
                _, _, have, stride = views[self._index(accessor, "bufferView", where, len(views))]
                stride = stride or number * each
                need = self._count(accessor, "byteOffset", where, 0) + max(count - 1, 0) * stride + number * each
                if stride < number * each or need > have:
                    found = f"{need} bytes, where its bufferView has {have}"
                    self._refuse(where, f"{count} entries that are there", found, "Copy it anew, whole.")

    def _primitive(self, primitive: dict, where: str) -> None:
        attributes = primitive.get("attributes")
        if not isinstance(attributes, dict) or primitive.get("mode", 4) not in MODES:
            self._refuse(where, "triangles or strips of them, with attributes", shown(primitive), PLAIN)
        if "material" in primitive:
            self._index(primitive, "material", where, len(self._parts("materials")))
        named = [*attributes.items(), *([("indices", primitive["indices"])] if "indices" in primitive else [])]
        accessors = self._listed(self.content, "accessors")
        for key, index in named:
            accessor = accessors[self._index({key: index}, key, where, len(accessors))]
            kinds, types = READ_AS.get(key, (None, None))
            if kinds is not None and (accessor["componentType"] not in kinds or accessor["type"] not in types):
                found = f"type {accessor['componentType']} of {accessor['type']}"
                self._refuse(f"{where}.{key}", "types of numbers that are read", found, PLAIN)
            if "bufferView" not in accessor or "sparse" in accessor:
                self._refuse(f"{where}.{key}", "numbers in a buffer", "compressed or sparse ones, or none", PLAIN)
            if key in ("TEXCOORD_0", "COLOR_0") and accessor["count"] != (need := self._points(attributes, where)):
                self._refuse(f"{where}.{key}", f"{need} entries, one a point", f"{accessor['count']}", PLAIN)

    def _still(self, node: dict, where: str) -> None:
        """Refuse a mesh that is moved by a skeleton, or by shapes beside its own: its points are read as stored."""
        meshes = self._listed(self.content, "meshes")
        mesh = meshes[self._index(node, "mesh", where, len(meshes))]
        if "skin" in node:
            remedy = "Apply what moves it (in Blender its armature), and export it again."
            self._refuse(f"{where}.skin", "a mesh that stands still", "one that a skeleton moves", remedy)
        weights = node.get("weights", mesh.get("weights", []))
        if not isinstance(weights, list) or any(weights):
            remedy = "Apply its shapes (in Blender its shape keys), and export it again."
            self._refuse(f"{where}.weights", "a mesh of one shape", f"others with weights {shown(weights)}", remedy)

    def _points(self, attributes: dict, where: str) -> int:
        accessors = self._listed(self.content, "accessors")
        return accessors[self._index(attributes, "POSITION", where, len(accessors))]["count"]

    def _images(self, buffers: list[bytes | Path | slice]) -> None:
        """Look at the pictures that are colours: without one of them the decoder would go on, with another colour."""
        textures, images = self._parts("textures"), self._parts("images")
        for where, material in self._parts("materials"):
            colour = self._object(material, "pbrMetallicRoughness", where)
            factor = numbers(colour.get("baseColorFactor", [1.0] * 4), 4, f"{self.path}: {where}", "baseColorFactor")
            if not all(0.0 <= one <= 1.0 for one in factor):
                self._refuse(f"{where}.baseColorFactor", "numbers from 0 to 1", shown(factor), PLAIN)
            metallic = numbers([colour.get("metallicFactor", 0.0)], 1, f"{self.path}: {where}", "metallicFactor")
            if not 0.0 <= metallic[0] <= 1.0:
                self._refuse(f"{where}.metallicFactor", "a number from 0 to 1", shown(metallic[0]), PLAIN)
            for key in ("baseColorTexture", "metallicRoughnessTexture"):
                used = self._object(colour, key, where)
                if not used:
                    continue
                if self._count(used, "texCoord", where, 0) != 0:
                    self._refuse(f"{where}.texCoord", "one set of texture coordinates", "another one", PLAIN)
                place, texture = textures[self._index(used, "index", where, len(textures))]
                if "sampler" in texture:
                    self._index(texture, "sampler", place, len(self._parts("samplers")))
                self._image(*images[self._index(texture, "source", place, len(images))], buffers)

    def _image(self, where: str, image: dict, buffers: list[bytes | Path | slice]) -> None:
        uri = image.get("uri")
        if "bufferView" in image:
            views = self._parts("bufferViews")
            place, view = views[self._index(image, "bufferView", where, len(views))]
            buffer, start, length, _ = self._view(place, view, buffers)
            check_texture(self._bytes(buffers[buffer], start, length), self.path)
        elif isinstance(uri, str) and uri in self.links.textures:
            file = input_file(self.links.textures[uri], f"a texture that {self.path.name} names")
            check_texture(file.read_bytes(), file)
        else:
            check_texture(self._decoded(uri, where), self.path)

    def _tree(self) -> None:
        """Refuse nodes that are their own descendants, or have two parents: nobody could say what stands where."""
        nodes = self._parts("nodes")
        parents: dict[int, str] = {}
        below: list[list[int]] = []
        for where, node in nodes:
            children = node.get("children", [])
            if not isinstance(children, list):
                self._refuse(f"{where}.children", "a list of nodes", shown(children), PLAIN)
            below.append([self._index({"children": one}, "children", where, len(nodes)) for one in children])
            for child in below[-1]:
                if child in parents:
                    found = f"two: {parents[child]} and {where}"
                    self._refuse(f"nodes[{child}]", "at most one parent", found, PLAIN)
                parents[child] = where
        left = [number for number in range(len(nodes)) if number not in parents]
        reached = 0
        while left:
            reached += 1
            left.extend(below[left.pop()])
        if reached < len(nodes):
            self._refuse("nodes", "trees", "a node that is its own descendant", PLAIN)

    def _object(self, holder: dict, key: str, where: str) -> dict:
        value = holder.get(key, {})
        if not isinstance(value, dict):
            self._refuse(f"{where}.{key}", "an object", shown(value), PLAIN)
        return value

    def _size(self, buffer: bytes | Path | slice) -> int:
        if isinstance(buffer, slice):
            return max(0, min(buffer.stop, self.path.stat().st_size) - buffer.start)
        return buffer.stat().st_size if isinstance(buffer, Path) else len(buffer)

    def _bytes(self, buffer: bytes | Path | slice, start: int, length: int) -> bytes:
        if isinstance(buffer, bytes):
            return buffer[start : start + length]
        first, file = (buffer.start, self.path) if isinstance(buffer, slice) else (0, buffer)
        return self._read(slice(first + start, first + start + length), file)

    def _read(self, place: slice, file: Path | None = None) -> bytes:
        with (file or self.path).open("rb") as stream:
            stream.seek(place.start)
            return stream.read(place.stop - place.start)

    def _parts(self, key: str) -> list[tuple[str, dict]]:
        return [(f"{key}[{number}]", part) for number, part in enumerate(self._listed(self.content, key))]

    def _listed(self, holder: dict, key: str, where: str = "") -> list[dict]:
        parts = holder.get(key, [])
        if not isinstance(parts, list) or not all(isinstance(part, dict) for part in parts):
            self._refuse(f"{where}.{key}" if where else key, "a list of objects", shown(parts), PLAIN)
        return parts

    def _index(self, holder: dict, key: str, where: str, count: int) -> int:
        index = self._count(holder, key, where)
        if index >= count:
            self._refuse(f"{where}.{key}", f"the number of one of {count}", str(index), PLAIN)
        return index

    def _count(self, holder: dict, key: str, where: str, default: int | None = None) -> int:
        """A whole number that is not negative."""
        value = holder.get(key, default)
        if type(value) is not int or not 0 <= value < 2**53:
            self._refuse(f"{where}.{key}", "a whole number, not negative", shown(value), PLAIN)
        return value

    def _refuse(self, where: str, expected: str, found: str, remedy: str) -> NoReturn:
        raise InputError(f"{self.path}: {where}", expected=expected, found=found, remedy=remedy)
