#include "server/import/FormatTable.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>

namespace tessera {
namespace {

constexpr FormatRow kTable[] = {
    {"Tessera's scene", "tsct tsc", "our own", "everything; saved scenes are as they were, object by object",
     "what a newer version saved and this one does not know"},
    {"glTF 2.0", "gltf glb", "our own, on tinygltf; libdraco, libmeshoptimizer",
     "nodes, meshes of all modes, sparse accessors, two sets of texture coordinates, one of colours, tangents, "
     "materials, textures with their samplers, cameras, skins, morph targets, all animations. Extensions: "
     "KHR_draco_mesh_compression, EXT_meshopt_compression, KHR_meshopt_compression, KHR_mesh_quantization, "
     "KHR_lights_punctual, KHR_texture_transform, EXT_mesh_gpu_instancing (with _COLOR_0), EXT_texture_webp, "
     "MSFT_texture_dds, "
     "KHR_materials_unlit, "
     "_emissive_strength, _ior, _specular, _clearcoat, _transmission (of these four the factors), and, as a plastic, "
     "_pbrSpecularGlossiness",
     "KHR_texture_basisu (refused by name; the texture's other image is shown), the textures of _specular, _clearcoat "
     "and _transmission, other material extensions, KHR_materials_variants, scenes but the "
     "file's own choice. Of orthographic cameras a picture in perspective arrives. A file that insists on another "
     "extension is refused"},
    {"USD", "usd usda usdc usdz", "our own; liblz4",
     "layers, references, payloads, inherits, specializes, variants (--variant PRIM:SET=NAME chooses others), files "
     "without defaultPrim, all transforms and their samples as an Animation, units and up axis, visibility, polygons "
     "with every interpolation, inherited primvars, subsets, subdivision surfaces, points, curves as lines, six "
     "shapes, instances (beyond 10,000, or in colours of their own, of small meshes as Glyphs), UsdPreviewSurface with "
     "its pictures, displayColor, "
     "lights, cameras",
     "skeletons, blend shapes, MaterialX, NURBS, widths of curves, volumes, value clips, relocates, splines, "
     "collections, points that move, texture coordinates of subdivision surfaces (a mesh with "
     "pictures is shown as its polygons), what lies outside the file's folder"},
    {"Wavefront OBJ", "obj", "our own; material libraries by assimp",
     "objects, groups, polygons, lines, points, texture coordinates, normals, colours of vertices, materials with "
     "their pictures of colour, normals, glow, metal and roughness, free-form surfaces with trims",
     "smoothing groups (edges above 60 degrees are sharp), free-form curves, what is of version 2.11, pictures of "
     "other kinds, their scale and offset, materials beyond 8192; beside free-form surfaces polygons' looks, lines "
     "and points"},
    {"PLY", "ply", "our own; files with an element 'material' by assimp",
     "text and both orders of bytes, polygons, strips, points, normals, colours of vertices, texture coordinates of "
     "vertices and of corners, one picture (comment TextureFile), materials",
     "other properties and elements, edges"},
    {"STL", "stl", "our own",
     "text and bytes, each solid with its name, facets of many corners, normals of facets, colours of facets as "
     "VisCAM and as Magics write them",
     "Magics' material beside its colour; above 16 million triangles facets are shown smooth"},
    {"OFF", "off", "assimp",
     "polygons, colours, normals and texture coordinates of vertices (NOFF, COFF, STOFF, 4OFF, nOFF)",
     "colours of faces; binary OFF"},
    {"Volumes: MetaImage, VolVis, legacy VTK, NRRD", "mhd mha slc vtk nrrd nhdr", "our own",
     "one number a voxel, of any type; origin and spacing",
     "packed data, several numbers a voxel, turned axes; of VTK all but structured points"},
    {"FBX", "fbx", "assimp",
     "nodes, meshes, materials with pictures, embedded ones too, skins, morph targets, animations, cameras, lights (a "
     "distance of decay is where light is halved)",
     "NURBS, curves, constraints, animated weights of targets of several steps"},
    {"Collada", "dae zae xml", "assimp",
     "nodes, meshes, two sets of texture coordinates, materials with pictures, skins, animations, cameras, lights but "
     "ambient ones",
     "morph targets, splines, physics, soft edges of spots, the angle of cameras without a name"},
    {"Blender", "blend", "assimp",
     "nodes, meshes, materials, cameras and lamps of Blender 2.4 to 2.7, pictures inside, also in gzip",
     "the lens of a camera but of few versions, the kind of a lamp but points, suns and areas, animations, bones, "
     "modifiers but Mirror and Subdivision, node materials. Of newer "
     "versions little or nothing: export .glb there"},
    {"3D Studio", "3ds prj ase ask", "assimp",
     "nodes, meshes, materials with pictures, animations of nodes, lights, cameras of ase",
     "of 3ds with key frames where cameras and spots look: such cameras are left out; ranges of lights"},
    {"LightWave, Modo", "lwo lxo lws mot", "assimp",
     "layers, meshes, materials with pictures, of scenes (.lws) motions of nodes, cameras, lights",
     "the zoom of cameras, which are 45 degrees wide, ranges of lights, procedural textures, projections (shown by the "
     "mesh's own coordinates), bones"},
    {"DirectX", "x", "assimp", "nodes, meshes, materials with pictures, skins, animations",
     "cameras and lights, which the format has not"},
    {"OpenGEX", "ogex", "assimp", "nodes, meshes, materials with pictures, cameras", "lights, skins, animations"},
    {"3MF", "3mf", "our own; expat, zlib",
     "packages of several models (production extension), units as metres, the title, objects by name or part number, "
     "components and items as shared meshes, base materials, colours of corners, pictures, mixtures and layers of "
     "these (materials extension), two sides where an object's type is no solid; objects of type other behind a Switch",
     "beam lattices, slices, how materials shine (display properties), all but one picture on a triangle, what slicers "
     "paint on triangles or keep beside the model, other metadata. A file that insists on another extension is "
     "refused"},
    {"AMF", "amf", "our own; expat, zlib",
     "XML, or that in a zip archive: units as metres, names, objects with all their volumes, colours of triangles, "
     "vertices, volumes, objects and materials, of which the earlier counts, constellations as shared meshes",
     "curved triangles (edges, normals), pictures on triangles, colours by formula, mixtures of materials, other "
     "metadata"},
    {"AC3D", "ac ac3d acc", "assimp",
     "nodes, surfaces, lines, materials, one picture an object, subdivision as triangles, lights", "files in UTF-16"},
    {"Buildings: IFC, STEP", "ifc ifczip step stp", "assimp",
     "of IFC 2x3 its tree with names, walls, slabs and openings as triangles, plain materials",
     "IFC 4 for the most part, properties, curved surfaces; other STEP files are refused"},
    {"DXF", "dxf", "our own",
     "R12 to R2018, text and binary; layers as nodes, those that are off or frozen behind a Switch; lines, arcs, "
     "ellipses, splines, polylines with bulges, points, faces, solids, polyface and M x N meshes, MESH, filled hatches "
     "with holes, thickness, TEXT, MTEXT and attributes, blocks as shared meshes (INSERT, also in rows, DIMENSION), "
     "leaders; colours by number and true ones; units as metres",
     "paper space, solids and surfaces of ACIS, patterns and gradients of hatches, line types, widths and arrow heads, "
     "fonts and the slant of letters, RAY, XLINE, MLINE, pictures, external references, other code pages than 1252, "
     "1251, 437, 850 and UTF-8"},
    {"VRML, X3D, Inventor", "wrl vrml wrz x3d x3dv x3db iv", "Coin; X3D put into VRML by our own",
     "VRML 1 and 2, X3D as XML and in the classic encoding, Inventor in text and binary, all in gzip too: groups, DEF "
     "and USE as shared meshes, PROTO and EXTERNPROTO, Switch and LOD with all children, Inline and File of the "
     "folder, Billboard, all shapes of these (of X3D the 3D and 2D ones) as triangles, lines and points, colours of "
     "corners, text, materials, pictures (also within the file) with TextureTransform, lights, viewpoints as cameras "
     "(bookmarks 1 to 9), "
     "the colours of a background; interpolators of Transform, Viewpoint, Material and lights' intensity; those of "
     "faces' coordinates as morph targets; an animation for each TimeSensor that drives any; Inventor's LevelOfDetail "
     "by size on the screen",
     "scripts and their kind (refused by name), sensors, fog, sound, films, pictures of a background, navigation; "
     "interpolators of normals, lines' points, lights' colours and places, and all other fields; routes "
     "within a prototype to another one's interface; of Inventor engines, manipulators, shaders, clip planes, NURBS; "
     "X3D's NURBS, "
     "humanoids, geospatial and rigid bodies; X3D in binary (.x3db) is refused",
     false, "tessera-import-coin"},
    {"Motion: BVH, CharacterStudio", "bvh csm", "assimp", "the skeleton as triangles, and its motion",
     "nothing is known to be lost"},
    {"Half-Life, Quake, Doom and their kind", "smd vta md2 md3 mdc mdl md5mesh md5anim md5camera bsp pk3 iqm hmp",
     "assimp",
     "meshes, skins (pictures) beside the file; bones and animations of smd, md5 and iqm; levels as triangles",
     "frames of md2, md3, mdc and mdl but the first, shaders, light maps, vta's flexes; of md5camera everything"},
    {"MilkShape, B3D, MMD", "ms3d b3d pmx", "assimp",
     "meshes, materials with pictures, bones and animations of ms3d and b3d; of pmx the mesh and its bones",
     "physics and morphs of pmx"},
    {"Ogre", "mesh mesh.xml", "assimp", "meshes, their materials beside the file, skeletons and their animations",
     "levels of detail, poses"},
    {"trueSpace, XGL, Silo, Nendo, Quick3D, NFF, Irrlicht", "cob scn xgl zgl sib ndo q3o q3s enff nff irr irrmesh",
     "assimp", "nodes and meshes; materials and pictures where the format has them; lights and cameras of nff, sib",
     "lights and cameras of the others, subdivision of sib. Irrlicht's files are refused for the most part: assimp "
     "5.2.5 does "
     "not read their XML"},
    {"Unreal, Terragen, RAW, assbin", "3d uc ter raw assbin", "assimp",
     "one mesh of triangles, or a height field; of assbin what assimp wrote",
     "frames but the first; of assbin cameras and lights"},
    {"PNG, JPEG, BMP, TGA, GIF, PIC, PSD, MNG", "png jpg jpeg bmp tga gif pic psd mng",
     "PNG and MNG by libpng, others by stb_image",
     "pixels with their opacity; of animations (APNG too) the first picture",
     "16 bits a channel become 8; layers but the joined one of a PSD; JNG, also in MNG, and PNG of iPhones (CgBI): "
     "refused by name",
     true},
    {"WebP, TIFF", "webp tif tiff", "libwebp, libtiff", "pixels with their opacity", "frames and pages but the first",
     true},
    {"PNM, SGI, Radiance", "ppm pgm pbm pam sgi rgb hdr", "our own", "pixels; of Radiance light as strong as it is",
     "16 bits a channel become 8", true},
    {"OpenEXR", "exr", "OpenEXR",
     "light as strong as it is, of lines and tiles in all compressions; the first part that has colours, of its layers "
     "those without a name, else Combined, else the first; the display window",
     "opacity; layers, parts and levels but one; primaries other than Rec. 709's; deep pixels: refused by name", true},
    {"DDS, KTX, KTX2, ASTC, PKM", "dds ktx ktx2 astc pkm", "our own; libzstd",
     "blocks (BC1 to BC7, without a sign) as they are, with their mipmaps; ETC1, ETC2, EAC and ASTC as pixels; cubes, "
     "solids, pixels, floats",
     "the mipmaps of pixels but the largest that is not too large: others are made anew. Refused by name: BasisLZ, "
     "UASTC (`ktx transcode` makes BC7 "
     "of "
     "them), ASTC of HDR or in three dimensions, arrays. Other pictures refused by name: Basis, AVIF, HEIC, JPEG 2000, "
     "SVG",
     true},
};

template <typename Visit>
void forEachWord(std::string_view text, Visit&& visit) {
    while (!text.empty()) {
        const std::string_view word = text.substr(0, text.find(' '));
        if (!word.empty()) visit(word);
        text.remove_prefix(std::min(word.size() + 1, text.size()));
    }
}

/// Lines that begin below each other, behind their heading.
void appendWrapped(std::string& out, std::string_view heading, std::string_view text) {
    constexpr std::size_t kWidth = 80, kIndent = 12;
    std::string line = fmt::format("  {:<{}}", heading, kIndent - 2);
    forEachWord(text, [&](std::string_view word) {
        const bool begins = line.find_last_not_of(' ') == line.npos || line.back() == ' ';
        if (!begins && line.size() + 1 + word.size() > kWidth) {
            out.append(line).push_back('\n');
            line.assign(kIndent, ' ');
        } else if (!begins) {
            line.push_back(' ');
        }
        line.append(word);
    });
    out.append(line).push_back('\n');
}

}  // namespace

std::span<const FormatRow> formatTable() {
    return kTable;
}

std::vector<std::string_view> modelEndings() {
    std::vector<std::string_view> all;
    for (const FormatRow& row : kTable)
        if (!row.isPicture) forEachWord(row.endings, [&](std::string_view ending) { all.push_back(ending); });
    std::ranges::sort(all);
    return all;
}

bool isModelEnding(std::string_view extension) {
    static const std::vector<std::string_view> kEndings = modelEndings();
    return std::ranges::binary_search(kEndings, extension);
}

std::string_view readingProgram(std::string_view extension) {
    for (const FormatRow& row : kTable) {
        bool reads = false;
        if (!row.isPicture) forEachWord(row.endings, [&](std::string_view ending) { reads |= ending == extension; });
        if (reads) return row.program;
    }
    return FormatRow{}.program;
}

std::string formatsText() {
    std::string text;
    for (const FormatRow& row : kTable) {
        std::vector<std::string> endings;
        forEachWord(row.endings, [&](std::string_view ending) { endings.push_back(fmt::format(".{}", ending)); });
        if (!text.empty()) text.push_back('\n');
        text += fmt::format("{}{}\n", row.isPicture ? "Pictures: " : "", row.name);
        appendWrapped(text, "endings", fmt::format("{}", fmt::join(endings, " ")));
        appendWrapped(text, "read by", row.reader);
        appendWrapped(text, "arrives", row.arrives);
        appendWrapped(text, "does not", row.lost);
    }
    return text;
}

}  // namespace tessera
