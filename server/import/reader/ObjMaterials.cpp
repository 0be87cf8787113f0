#include "server/import/reader/ObjMaterials.h"

#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <functional>
#include <set>
#include <string_view>

#include "server/import/reader/AssimpFiles.h"
#include "server/import/reader/AssimpMaterials.h"

namespace tessera {
namespace {

/// A word and the trimmed rest of each line that has both.
void forLines(std::string_view left, const std::function<void(std::string_view, std::string_view)>& visit) {
    while (!left.empty()) {
        constexpr const char* kSpace = " \t\r";
        const std::string_view all = left.substr(0, left.find('\n'));
        left.remove_prefix(std::min(left.size(), all.size() + 1));
        const std::size_t start = all.find_first_not_of(kSpace);
        const std::size_t gap = all.find_first_of(kSpace, start);
        const std::size_t rest = all.find_first_not_of(kSpace, gap);
        if (start == all.npos || gap == all.npos || rest == all.npos) continue;
        visit(all.substr(start, gap - start), all.substr(rest, all.find_last_not_of(kSpace) + 1 - rest));
    }
}

}  // namespace

void ObjNames::add(std::string_view text) {
    forLines(text, [this](std::string_view word, std::string_view rest) {
        if (word == "mtllib") libraries.emplace(rest);
        if (word == "usemtl") used.emplace(rest);
    });
}

std::map<std::string, std::string> readObjMaterials(const std::vector<std::string>& libraries,
                                                    const std::vector<std::string>& used, const std::string& path,
                                                    const FolderFiles& files, const ReadLimits& limits,
                                                    PlainScene& scene) {
    std::map<std::string, std::string> out;
    if (used.empty()) return out;
    std::string text;
    for (const std::string& library : libraries) text += "mtllib " + library + "\n";
    text += "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (const std::string& name : used) text += "usemtl " + name + "\nf 1 2 3\n";
    // Never deleted, as in AssimpReader.cpp: what it holds is looked at until the process ends.
    Assimp::Importer& importer = *new Assimp::Importer;
    importer.SetIOHandler(new InPlaceOf(files, path, text));
    const aiScene* read = importer.ReadFile(path, 0);
    if (read == nullptr) {
        scene.note("its materials cannot be read and are left out");
        return out;
    }
    AssimpMaterials materials(*read, files, limits, true, scene);
    for (unsigned i = 0; i < read->mNumMaterials; ++i) {
        aiString name;
        if (read->mMaterials[i]->Get(AI_MATKEY_NAME, name) == aiReturn_SUCCESS &&
            std::ranges::find(used, name.C_Str()) != used.end())
            out.emplace(name.C_Str(), materials.name(i));
    }
    materials.finish();
    return out;
}

void noteObjMaterials(const std::string& path, const FolderFiles& files, PlainScene& scene) {
    ObjNames names;
    // Of what cannot be read: nothing.
    if (const Expected<Bytes> bytes = files.read(path)) names.add(asText(*bytes));
    noteObjMaterials(names, files, scene);
}

void noteObjMaterials(const ObjNames& names, const FolderFiles& files, PlainScene& scene) {
    constexpr std::size_t kNamed = 8;  // of many the first ones
    std::set<std::string> defined;
    // A file without a library says nothing of looks, whatever names it uses.
    const std::set<std::string> used = names.libraries.empty() ? std::set<std::string>() : names.used;
    bool moved = false;
    std::size_t missing = 0;
    for (const std::string& library : names.libraries) {
        const Expected<FolderFiles::Found> found = files.find(library);
        if (found && !found->note.empty()) scene.note("the material library " + found->note);
        if (!found) {
            if (++missing <= kNamed)
                scene.note(fmt::format("the material library {} is left out: {}", library, found.error().message));
            continue;
        }
        const Expected<Bytes> lines = files.readFound(*found);
        if (!lines && ++missing <= kNamed)
            scene.note(fmt::format("the material library is left out: {}", lines.error().message));
        if (!lines) continue;
        forLines(asText(*lines), [&](std::string_view word, std::string_view rest) {
            if (word == "newmtl") defined.emplace(rest);
            for (const char* option : {"-s ", "-o ", "-t "})
                moved = moved || (word.starts_with("map_") &&
                                  (" " + std::string(rest)).find(std::string(" ") + option) != std::string::npos);
        });
    }
    if (moved) scene.note("scale, offset and turbulence of images are left out");
    std::size_t unknown = 0;
    for (const std::string& name : used)
        if (!defined.contains(name) && ++unknown <= kNamed) scene.note(fmt::format("there is no material '{}'", name));
    if (unknown > kNamed) scene.note(fmt::format("{} more materials are not there", unknown - kNamed));
}

}  // namespace tessera
