#include "server/import/reader/ReadScene.h"

#include <unistd.h>

#include <cstring>

#include "common/base/LowerCase.h"
#include "common/confine/OrdinaryFile.h"
#include "server/import/reader/VolumeFiles.h"

namespace tessera {
namespace {

std::string extensionOf(const std::string& path) {
    const std::size_t dot = path.rfind('.');
    if (dot == std::string::npos || path.find('/', dot) != std::string::npos) return {};
    return lowerCase(path.substr(dot + 1));
}

bool beginsWith(const std::string& path, const char* magic) {
    char head[4] = {};
    const Expected<OrdinaryFile> file = openOrdinaryFile(path);
    const ssize_t got = file ? ::read(file->handle.get(), head, sizeof(head)) : -1;
    return got == static_cast<ssize_t>(sizeof(head)) && std::memcmp(head, magic, sizeof(head)) == 0;
}

/// What people have most of, and in the largest files.
Expected<PlainScene> readMesh(const std::string& path, const std::string& extension, const ReadLimits& limits) {
    if (extension == "obj") return readObj(path, limits);
    if (extension == "stl") return readStl(path, limits);
    if (extension == "ply") return readPly(path, limits);
    return fail(ErrorCode::kUnsupported, "none of these");
}

bool isUsdFile(const std::string& extension) {
    return extension == "usd" || extension == "usda" || extension == "usdc" || extension == "usdz";
}

Expected<PlainScene> readByEnding(const std::string& path, const std::string& extension, const ReadLimits& limits) {
    if (extension == "tsct") return readSceneText(path, limits);
    if (extension == "tsc") return readSceneBinary(path, limits);
    if (isVolumeFile(extension)) return readVolume(path, limits);
    if (extension == "gltf" || extension == "glb" || beginsWith(path, "glTF")) return readGltf(path, limits);
    if (isUsdFile(extension)) return readUsd(path, limits);
    if (extension == "dxf") return readDxf(path, limits);
    if (extension == "3mf") return readThreeMf(path, limits);
    if (extension == "amf") return readAmf(path, limits);
    if (!limits.verbatim) {
        Expected<PlainScene> mesh = readMesh(path, extension, limits);
        if (mesh || mesh.error().code != ErrorCode::kUnsupported) return mesh;
    }
    // Before what reads polygons alone: a file may have both.
    if (extension == "obj") {
        Expected<PlainScene> surfaces = readObjSurfaces(path, limits);
        if (surfaces || surfaces.error().code != ErrorCode::kUnsupported) return surfaces;
    }
    if (limits.verbatim) {
        Expected<PlainScene> text = readTextMesh(path, extension, limits);
        if (text || text.error().code != ErrorCode::kUnsupported) return text;
    }
    return readWithAssimp(path, limits);
}

}  // namespace

Expected<PlainScene> readScene(const std::string& path, const ReadLimits& limits) {
    const std::string extension = extensionOf(path);
    Expected<PlainScene> scene = readByEnding(path, extension, limits);
    if (scene && !limits.variants.empty() && !isUsdFile(extension))
        scene->note("--variant does nothing here: files of USD alone have variants");
    return scene;
}

}  // namespace tessera
