/// The readers: one file in, one scene in plain form out. They run in the confined child; nothing here trusts the file,
/// but nothing here is trusted either.
#pragma once

#include <set>
#include <string>

#include "common/base/Error.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

/// glTF 2.0, text or binary, by tinygltf.
[[nodiscard]] Expected<PlainScene> readGltf(const std::string& path, const ReadLimits& limits);
/// USD: text, crates and packages (.usd, .usda, .usdc, .usdz), by our own readers (usd/).
[[nodiscard]] Expected<PlainScene> readUsd(const std::string& path, const ReadLimits& limits);
/// Whatever assimp reads: OBJ, PLY, STL, ….
[[nodiscard]] Expected<PlainScene> readWithAssimp(const std::string& path, const ReadLimits& limits);
/// An OBJ's free-form surfaces, a node each, beside its polygons. kUnsupported where it has none.
[[nodiscard]] Expected<PlainScene> readObjSurfaces(const std::string& path, const ReadLimits& limits);
/// OBJ of polygons, lines and points. kUnsupported: of free-form surfaces, or with what only readWithAssimp may know.
[[nodiscard]] Expected<PlainScene> readObj(const std::string& path, const ReadLimits& limits);
/// DXF, in text and in binary.
[[nodiscard]] Expected<PlainScene> readDxf(const std::string& path, const ReadLimits& limits);
/// What 3D printers read: 3MF, and AMF as XML or zipped.
[[nodiscard]] Expected<PlainScene> readThreeMf(const std::string& path, const ReadLimits& limits);
[[nodiscard]] Expected<PlainScene> readAmf(const std::string& path, const ReadLimits& limits);
/// STL and PLY. kUnsupported: what only readWithAssimp may know, or can refuse in words.
[[nodiscard]] Expected<PlainScene> readStl(const std::string& path, const ReadLimits& limits);
[[nodiscard]] Expected<PlainScene> readPly(const std::string& path, const ReadLimits& limits);
/// OBJ, OFF and what is text of PLY and STL, geometry alone, for ReadLimits::verbatim; messages carry the line.
/// kUnsupported for all other files. `extension`: in lower case, without its dot.
[[nodiscard]] Expected<PlainScene> readTextMesh(const std::string& path, const std::string& extension,
                                                const ReadLimits& limits);
/// A scalar field as a Volume: see VolumeFiles.h.
[[nodiscard]] Expected<PlainScene> readVolume(const std::string& path, const ReadLimits& limits);
/// Tessera's own text (.tsct); messages carry line and column.
[[nodiscard]] Expected<PlainScene> readSceneText(const std::string& path, const ReadLimits& limits);
/// Tessera's own binary (.tsc).
[[nodiscard]] Expected<PlainScene> readSceneBinary(const std::string& path, const ReadLimits& limits);

/// Of all files that are read here, by anybody: ".3ds", ".dae", ….
[[nodiscard]] std::set<std::string> allEndings();
/// The reader for the file, by its extension; GLB also by its first bytes. `path`: absolute, without symbolic links.
[[nodiscard]] Expected<PlainScene> readScene(const std::string& path, const ReadLimits& limits);

}  // namespace tessera
