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

namespace {

/// Libraries that a line names, each with what is wrong with it. Names may have blanks in them, or be several.
struct Library {
    std::string name;
    Expected<FolderFiles::Found> found;
};
std::vector<Library> librariesIn(const std::string& line, const std::string& path, const FolderFiles& files) {
    std::vector<Library> all;
    Expected<FolderFiles::Found> whole = files.find(line);
    bool isSeveral = false;
    std::size_t at = whole ? line.npos : line.find_first_not_of(" \t");
    while (at != line.npos) {
        const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
        std::string word = line.substr(at, end - at);
        Expected<FolderFiles::Found> found = files.find(word);
        isSeveral = isSeveral || (found && word != line);
        all.push_back({std::move(word), std::move(found)});
        at = line.find_first_not_of(" \t", end);
    }
    if (isSeveral) return all;
    all.clear();
    // As assimp does: many a tool has renamed a model and its library, and not what stands in it.
    if (!whole) {
        const std::string model = path.substr(path.rfind('/') + 1), beside = model.substr(0, model.rfind('.')) + ".mtl";
        if (Expected<FolderFiles::Found> other = files.find(beside)) {
            other->note = fmt::format("{} is not there: {} is read", line.substr(0, 200), beside);
            whole = std::move(other);
        }
    }
    all.push_back({line, std::move(whole)});
    return all;
}

/// What libraries say of each of `used`, which is all that assimp is shown: it goes through a library for each
/// material.
std::map<std::string, std::string, std::less<>> definitionsOf(const std::vector<std::string>& libraries,
                                                              const std::set<std::string, std::less<>>& used,
                                                              const std::string& path, const FolderFiles& files) {
    std::map<std::string, std::string, std::less<>> definitions;
    for (const std::string& line : libraries)
        for (const Library& library : librariesIn(line, path, files)) {
            const Expected<Bytes> bytes =
                library.found ? files.readFound(*library.found) : tl::unexpected(library.found.error());
            if (!bytes) continue;
            std::string* into = nullptr;
            forLines(asText(*bytes), [&](std::string_view word, std::string_view rest) {
                if (word == "newmtl") into = used.contains(rest) ? &definitions[std::string(rest)] : nullptr;
                if (word != "newmtl" && into != nullptr) into->append(word).append(1, ' ').append(rest).push_back('\n');
            });
        }
    return definitions;
}

}  // namespace

std::map<std::string, std::string> readObjMaterials(const std::vector<std::string>& libraries,
                                                    const std::vector<std::string>& used, const std::string& path,
                                                    const FolderFiles& files, const ReadLimits& limits,
                                                    PlainScene& scene) {
    // Assimp takes 35 KB for each, and compares the name of each with those of all.
    constexpr std::size_t kMost = 8192;
    constexpr std::string_view kLibrary = "materials of this OBJ.mtl";
    std::map<std::string, std::string> out;
    if (used.empty()) return out;
    const std::map<std::string, std::string, std::less<>> definitions =
        definitionsOf(libraries, {used.begin(), used.end()}, path, files);
    // All that nothing is said of are one: the first of them.
    std::vector<std::string_view> shown, plain;
    for (const std::string& name : used) {
        const bool isShown = definitions.contains(name) && shown.size() < kMost;
        (isShown ? shown : plain).emplace_back(name);
    }
    if (definitions.size() > kMost)
        scene.note(
            fmt::format("of its {} materials the first {} are read; others are plain", definitions.size(), kMost));
    std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", library;
    if (!shown.empty()) text = fmt::format("mtllib {}\n", kLibrary) + text;  // assimp refuses one without a word
    for (const std::string_view name : shown) {
        text += fmt::format("usemtl {}\nf 1 2 3\n", name);
        library += fmt::format("newmtl {}\n{}", name, definitions.find(name)->second);
    }
    if (!plain.empty()) text += fmt::format("usemtl {}\nf 1 2 3\n", plain.front());
    // Never deleted, as in AssimpReader.cpp: what it holds is looked at until the process ends.
    Assimp::Importer& importer = *new Assimp::Importer;
    InPlaceOf* const io = new InPlaceOf(files, path, text);
    io->add(fmt::format("{}{}", path.substr(0, path.rfind('/') + 1), kLibrary), library + "\n");
    importer.SetIOHandler(io);
    const aiScene* read = importer.ReadFile(path, 0);
    if (read == nullptr) {
        scene.note("its materials cannot be read and are left out");
        return out;
    }
    AssimpMaterials materials(*read, files, limits, true, scene);
    const std::set<std::string_view> named(used.begin(), used.end());
    for (unsigned i = 0; i < read->mNumMaterials; ++i) {
        aiString name;
        if (read->mMaterials[i]->Get(AI_MATKEY_NAME, name) == aiReturn_SUCCESS && named.contains(name.C_Str()))
            out.emplace(name.C_Str(), materials.name(i));
    }
    materials.finish();
    const auto first = plain.empty() ? out.end() : out.find(std::string(plain.front()));
    for (const std::string_view name : plain)
        if (first != out.end()) out.emplace(name, first->second);
    return out;
}

void noteObjMaterials(const std::string& path, const FolderFiles& files, PlainScene& scene) {
    ObjNames names;
    // Of what cannot be read: nothing.
    if (const Expected<Bytes> bytes = files.read(path)) names.add(asText(*bytes));
    noteObjMaterials(names, path, files, scene);
}

void noteObjMaterials(const ObjNames& names, const std::string& path, const FolderFiles& files, PlainScene& scene) {
    constexpr std::size_t kNamed = 8;  // of many the first ones
    std::set<std::string> defined;
    // A file without a library says nothing of looks, whatever names it uses.
    const std::set<std::string> used = names.libraries.empty() ? std::set<std::string>() : names.used;
    bool moved = false;
    std::size_t missing = 0;
    const auto look = [&](const Library& library) {
        const Expected<FolderFiles::Found>& found = library.found;
        if (found && !found->note.empty()) scene.note("the material library " + found->note);
        if (!found) {
            if (++missing <= kNamed)
                scene.note(fmt::format("the material library {} is left out: {}", library.name.substr(0, 200),
                                       found.error().message));
            return;
        }
        const Expected<Bytes> lines = files.readFound(*found);
        if (!lines && ++missing <= kNamed)
            scene.note(fmt::format("the material library is left out: {}", lines.error().message));
        if (!lines) return;
        forLines(asText(*lines), [&](std::string_view word, std::string_view rest) {
            if (word == "newmtl") defined.emplace(rest);
            for (const char* option : {"-s ", "-o ", "-t "})
                moved = moved || (word.starts_with("map_") &&
                                  (" " + std::string(rest)).find(std::string(" ") + option) != std::string::npos);
        });
    };
    for (const std::string& line : names.libraries)
        for (const Library& library : librariesIn(line, path, files)) look(library);
    if (moved) scene.note("scale, offset and turbulence of images are left out");
    std::size_t unknown = 0;
    for (const std::string& name : used)
        if (!defined.contains(name) && ++unknown <= kNamed) scene.note(fmt::format("there is no material '{}'", name));
    if (unknown > kNamed) scene.note(fmt::format("{} more materials are not there", unknown - kNamed));
}

}  // namespace tessera
