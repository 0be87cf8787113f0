// PLY files that hold less than their header announces, more than is shown, or rows that are none.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/PlyFile.h"

namespace tessera {
namespace {

/// Named in a note; of more the others are counted.
constexpr std::size_t kMostNamed = 12;

/// What assimp 5.2.5 makes something of.
bool isShown(const std::string& element, const std::string& property) {
    static const std::map<std::string, std::set<std::string>> kShown = {
        {"vertex", {"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue",      "alpha",    "r",
                    "g", "b", "u", "v",  "s",  "t",  "tx",  "ty",    "texture_u", "texture_v"}},
        {"face", {"vertex_index", "vertex_indices", "texcoord"}},
        {"tristrips", {"vertex_index", "vertex_indices"}},
        {"material",
         {"ambient_red", "ambient_green", "ambient_blue", "ambient_alpha", "diffuse_red", "diffuse_green",
          "diffuse_blue", "diffuse_alpha", "specular_red", "specular_green", "specular_blue", "specular_alpha",
          "opacity", "specular_power"}}};
    const auto known = kShown.find(element);
    return known != kShown.end() && known->second.contains(property);
}

std::string someOf(const std::vector<std::string>& names) {
    const std::size_t named = std::min(names.size(), kMostNamed);
    const std::string some =
        fmt::format("{}", fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(named), ", "));
    return names.size() > named ? fmt::format("{} and {} more", some, names.size() - named) : some;
}

void noteFurther(const PlyFile& file, std::vector<std::string>& notes) {
    std::vector<std::string> wholly;
    const bool joins = file.joinsFaces();  // and nothing but corners is left of them
    for (const PlyElement& element : file.elements()) {
        std::vector<std::string> further;
        for (const PlyProperty& property : element.properties)
            if (!isShown(element.name, property.name) || (joins && property.name == "texcoord" && element.isOfFaces()))
                further.push_back(property.name);
        if (element.count == 0 || further.empty()) continue;
        if (further.size() == element.properties.size())
            wholly.push_back(fmt::format("{} {} ({})", element.count, element.name, someOf(further)));
        else
            notes.push_back(fmt::format("{} of each {} {} left out", someOf(further), element.name,
                                        further.size() == 1 ? "is" : "are"));
    }
    if (!wholly.empty()) notes.push_back(fmt::format("further elements are left out: {}", someOf(wholly)));
}

/// Assimp puts 0 where a vertex says nothing.
Expected<void> checkPlaces(const std::vector<PlyElement>& elements) {
    const auto vertices = std::ranges::find_if(
        elements, [](const PlyElement& element) { return element.isOfVertices() && element.count > 0; });
    if (vertices == elements.end()) return {};
    std::vector<std::string> missing;
    for (const char* const axis : {"x", "y", "z"})
        if (std::ranges::none_of(vertices->properties, [&](const PlyProperty& property) {
                return !property.isList && property.name == axis;
            }))
            missing.emplace_back(axis);
    if (missing.empty()) return {};
    return fail(ErrorCode::kBadInput,
                fmt::format("line {}: the element vertex has no {}", vertices->line, fmt::join(missing, ", ")));
}

/// Behind a number of a type that nobody knows nobody can tell where the next one begins; assimp cannot in text either.
Expected<void> checkTypes(const PlyFile& file) {
    for (const PlyElement& element : file.elements())
        for (const PlyProperty& property : element.properties)
            if (!property.unknownType.empty() && element.count > 0 &&
                (!file.isText() || element.isOfVertices() || element.isOfFaces()))
                return fail(ErrorCode::kBadInput, fmt::format("line {}: the type '{}' of {} is not known",
                                                              property.line, property.unknownType, property.name));
    return {};
}

/// Assimp makes the channels that are not there 0.
void noteColors(const PlyFile& file, std::vector<std::string>& notes) {
    for (const PlyElement& element : file.elements()) {
        if (!element.isOfVertices()) continue;
        const auto has = [&](std::string_view name) {
            return std::ranges::any_of(element.properties,
                                       [&](const PlyProperty& property) { return property.name == name; });
        };
        std::vector<std::string_view> there, missing;
        for (const auto& [name, brief] : {std::pair("red", "r"), std::pair("green", "g"), std::pair("blue", "b")})
            (has(name) || has(brief) ? there : missing).push_back(name);
        if (!missing.empty() && (!there.empty() || has("alpha")))
            notes.push_back(fmt::format("the colours of vertices have no {}: {} taken to be 0",
                                        fmt::join(missing, ", "), missing.size() == 1 ? "it is" : "they are"));
    }
}

Expected<void> noteCut(const PlyFile& file, std::vector<std::string>& missing) {
    const PlyElement* const cut = file.cut();
    if (cut == nullptr) return {};
    const std::vector<PlyElement>& elements = file.elements();
    const auto faces = std::ranges::find_if(
        elements, [](const PlyElement& element) { return element.isOfFaces() && element.count > 0; });
    const bool isCloud = faces == elements.end();
    std::string what = fmt::format("its header announces {} {} (line {}), and {} of them {} there: it is cut off",
                                   cut->count, cut->name, cut->line, cut->there, cut->there == 1 ? "is" : "are");
    // Without all vertices, or any faces, there is no mesh; of a cloud each point is good.
    const bool isLost =
        isCloud ? cut->isOfVertices() && cut->there == 0 : !(faces->there > 0 && (cut->isOfFaces() || cut > &*faces));
    const bool beforeVertices = std::ranges::none_of(
        elements, [](const PlyElement& element) { return element.isOfVertices() && element.there > 0; });
    if (isLost || beforeVertices) return fail(ErrorCode::kBadInput, what);
    missing.push_back(std::move(what));
    return {};
}

Expected<void> noteRows(const PlyFile& file, std::vector<std::string>& notes, std::vector<std::string>& missing) {
    std::uint64_t left = 0;
    std::string first;
    for (const PlyElement& element : file.elements()) {
        if (element.lacking > 0)
            notes.push_back(fmt::format("{} of {} vertices {} fewer numbers than the header asks for; the first, {}",
                                        element.lacking, element.there, element.lacking == 1 ? "has" : "have",
                                        element.firstLacking));
        if (element.longer > 0)
            notes.push_back(fmt::format("what is behind all that {} {} {} is left out (the first: line {})",
                                        element.longer,
                                        element.isOfVertices() ? "vertices"
                                        : element.isStrips()   ? "strips"
                                                               : "faces",
                                        element.longer == 1 ? "needs" : "need", element.firstLonger));
        if (!element.isOfFaces()) continue;
        left += element.there - element.leftOut;
        if (element.leftOut == 0) continue;
        missing.push_back(fmt::format("{} of {} {} {} left out; the first, {}", element.leftOut, element.there,
                                      element.isStrips() ? "strips" : "faces", element.leftOut == 1 ? "is" : "are",
                                      element.firstLeftOut));
        if (first.empty()) first = missing.back();
    }
    if (const std::string empty = file.emptyStrips(); !empty.empty()) {
        notes.push_back(empty);
        if (file.hasNoFaces()) return fail(ErrorCode::kBadInput, empty);
    }
    if (left == 0 && !first.empty()) return fail(ErrorCode::kBadInput, first);
    return {};
}

}  // namespace

Expected<void> notePlyHeader(const PlyFile& file, std::vector<std::string>& notes) {
    if (Expected<void> known = checkTypes(file); !known) return known;
    noteFurther(file, notes);
    noteColors(file, notes);
    return checkPlaces(file.elements());
}

Expected<bool> mendPly(Bytes& bytes, std::vector<std::string>& notes, std::vector<std::string>* missing) {
    // Of an old Macintosh: assimp's rows end with a line feed.
    const std::string_view text = asText(bytes);
    const bool isOld =
        text.starts_with("ply\r") && text.find("format ascii") != text.npos && text.find('\n') == text.npos;
    if (isOld) std::ranges::replace(bytes, std::byte{'\r'}, std::byte{'\n'});
    PlyFile file(asText(bytes));
    if (Expected<void> head = file.readHeader(); !head) return tl::unexpected(head.error());
    if (Expected<void> known = checkTypes(file); !known) return tl::unexpected(known.error());
    noteFurther(file, notes);
    noteColors(file, notes);
    Expected<void> sound = file.count();
    std::vector<std::string> gone;
    if (sound) sound = noteCut(file, gone);
    if (sound) sound = checkPlaces(file.elements());
    if (sound) sound = noteRows(file, notes, gone);
    if (!sound) return tl::unexpected(sound.error());
    notes.insert(notes.end(), gone.begin(), gone.end());
    if (missing != nullptr) *missing = std::move(gone);
    if (file.doubtfulLine() > 0) notes.push_back(doubtOfLastLine(file.doubtfulLine()));
    if (std::string behind = file.behind(); file.cut() == nullptr && !behind.empty())
        notes.push_back(std::move(behind));
    if (!file.toBeWritten()) return isOld;
    bytes = file.written();
    return true;
}

}  // namespace tessera
