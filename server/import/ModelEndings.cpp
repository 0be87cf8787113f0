#include "server/import/ModelEndings.h"

#include <algorithm>
#include <array>

namespace tessera {

std::span<const std::string_view> modelEndings() {
    // The importer's readers say what they read in a process of their own: a test compares.
    static constexpr std::array<std::string_view, 81> kEndings = {
        "3d",     "3ds",  "3mf",  "ac",      "ac3d", "acc", "amf",  "ase", "ask", "assbin",  "b3d",       "blend",
        "bsp",    "bvh",  "cob",  "csm",     "dae",  "dxf", "enff", "fbx", "glb", "gltf",    "hmp",       "ifc",
        "ifczip", "iqm",  "irr",  "irrmesh", "lwo",  "lws", "lxo",  "md2", "md3", "md5anim", "md5camera", "md5mesh",
        "mdc",    "mdl",  "mesh", "mha",     "mhd",  "mot", "ms3d", "ndo", "nff", "nhdr",    "nrrd",      "obj",
        "off",    "ogex", "pk3",  "ply",     "pmx",  "prj", "q3o",  "q3s", "raw", "scn",     "sib",       "slc",
        "smd",    "step", "stl",  "stp",     "ter",  "tsc", "tsct", "uc",  "usd", "usda",    "usdc",      "usdz",
        "vta",    "vtk",  "x",    "x3d",     "x3db", "xgl", "xml",  "zae", "zgl"};
    return kEndings;
}

bool isModelEnding(std::string_view extension) {
    return std::ranges::find(modelEndings(), extension) != modelEndings().end();
}

}  // namespace tessera
