// A glTF file and what it refers to, by tinygltf; GltfReader makes a scene of it.

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "server/import/reader/GltfCompression.h"
#include "server/import/reader/GltfReader.h"
#include "server/import/reader/ReadScene.h"

namespace tessera {
namespace {

struct FileAccess {
    const FolderFiles& files;
    std::string refusal;          ///< the first file that was not to be had
    std::set<std::string> notes;  ///< files that are elsewhere than they should be
};

/// As the file says it: tinygltf puts the folder in front.
std::string saidName(const FolderFiles& files, const std::string& name) {
    const std::string folder = files.folder() + "/";
    return name.starts_with(folder) ? name.substr(folder.size()) : name;
}

bool keepEncoded(tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* bytes,
                 int size, void*) {
    image->image.assign(bytes, bytes + size);
    return true;
}

bool fileExists(const std::string& name, void* user) {
    auto& access = *static_cast<FileAccess*>(user);
    const Expected<FolderFiles::Found> found = access.files.find(saidName(access.files, name));
    if (!found && access.refusal.empty()) access.refusal = found.error().message;
    return found.has_value();
}

bool readWhole(std::vector<unsigned char>* out, std::string* error, const std::string& name, void* user) {
    auto& access = *static_cast<FileAccess*>(user);
    const Expected<FolderFiles::Found> found = access.files.find(saidName(access.files, name));
    const Expected<Bytes> bytes = found ? access.files.readFound(*found) : tl::unexpected(found.error());
    if (bytes && !found->note.empty()) access.notes.insert(found->note);
    if (!bytes) {
        if (access.refusal.empty()) access.refusal = bytes.error().message;
        if (error != nullptr) *error += bytes.error().message + "\n";
        return false;
    }
    const auto* data = reinterpret_cast<const unsigned char*>(bytes->data());
    out->assign(data, data + bytes->size());
    return true;
}

std::string firstWords(std::string text) {
    while (!text.empty() && (text.front() == '\n' || text.front() == ' ')) text.erase(0, 1);
    text = text.substr(0, std::min(text.find('\n'), std::size_t{400}));
    while (!text.empty() && (text.back() == '.' || text.back() == ' ')) text.pop_back();
    return text;
}

/// tinygltf asks of skins what they need not have: without these matrices a skin is whole.
std::string withoutFalse(std::string complaints) {
    constexpr std::string_view kFalse = "'inverseBindMatrices' property is missing in Skin.\n";
    for (std::size_t at = 0; (at = complaints.find(kFalse, at)) != complaints.npos;)
        complaints.erase(at, kFalse.size());
    return complaints;
}

}  // namespace

Expected<PlainScene> readGltf(const std::string& path, const ReadLimits& limits) {
    const Expected<Bytes> bytes = readOrdinaryFile(path, std::min<std::size_t>(limits.maxFileBytes, 0x7fffffff));
    if (!bytes) return fail(bytes.error().code, "the file " + bytes.error().message);
    const FolderFiles files(path.substr(0, std::max<std::size_t>(path.rfind('/'), 1)), limits.maxFileBytes);
    FileAccess access{files, {}, {}};
    tinygltf::TinyGLTF loader;
    loader.SetImageLoader(&keepEncoded, nullptr);
    loader.SetFsCallbacks(
        {&fileExists, [](const std::string& name, void*) { return name; }, &readWhole,
         [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) { return false; }, &access});
    tinygltf::Model model;
    std::string error, warning;
    const std::optional<Bytes> withOwn = withStandIns(*bytes);
    const ByteSpan whole = withOwn ? ByteSpan(*withOwn) : ByteSpan(*bytes);
    const auto size = static_cast<unsigned>(whole.size());
    const bool binary = asText(whole).substr(0, 4) == "glTF";
    const bool done =
        binary ? loader.LoadBinaryFromMemory(&model, &error, &warning,
                                             reinterpret_cast<const unsigned char*>(whole.data()), size, files.folder())
               : loader.LoadASCIIFromString(&model, &error, &warning, reinterpret_cast<const char*>(whole.data()), size,
                                            files.folder());
    error = withoutFalse(std::move(error));
    if (!done) {
        // Such an extension may be why it makes no sense.
        if (Expected<void> shown = checkRequired(model); !shown) return tl::unexpected(shown.error());
        std::string reason = firstWords(error);
        if (!access.refusal.empty()) reason = access.refusal + (reason.empty() ? "" : " (" + reason + ")");
        return fail(ErrorCode::kBadInput, "it is not valid glTF: " + (reason.empty() ? "no reason given" : reason));
    }
    // What it insists on comes before what is wrong with that.
    if (Expected<void> shown = checkRequired(model); !shown) return tl::unexpected(shown.error());
    std::vector<std::string> notes;
    if (Expected<void> plain = expandMeshopt(model, limits.maxFileBytes); !plain) return tl::unexpected(plain.error());
    if (Expected<void> plain = expandDraco(model, limits.maxFileBytes, notes); !plain)
        return tl::unexpected(plain.error());
    GltfReader reader(model, files, limits);
    Expected<PlainScene> scene = reader.read();
    if (scene && model.asset.version.compare(0, 2, "2.") != 0) {
        // Many files that say 1.1 are 2.0 in all but name; the others come out empty.
        if (scene->file.node().empty())
            return fail(ErrorCode::kUnsupported, fmt::format("it is glTF {}; 2.0 is read here", model.asset.version));
        scene->note(fmt::format("it says that it is glTF {}; it was read as 2.0", model.asset.version));
    }
    notes.insert(notes.end(), access.notes.begin(), access.notes.end());
    for (const std::string& note : notes)
        if (scene) scene->note(note);
    const auto isSaid = [&](const std::string& note) { return note.find(access.refusal) != note.npos; };
    if (scene && !access.refusal.empty() && std::ranges::none_of(scene->notes, isSaid))
        scene->note(access.refusal + "; left out");
    // What it read nevertheless lacks the part that it complains of.
    if (scene && !error.empty()) scene->note("parts are not valid glTF and left out: " + firstWords(error));
    return scene;
}

}  // namespace tessera
