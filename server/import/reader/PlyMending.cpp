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
        {"vertex", {"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "alpha", "r", "g", "b", "u", "v", "s", "t", "tx", "ty", "texture_u", "texture_v"}},
        {"face", {"vertex_index", "vertex_indices", "texcoord"}},
        {"tristrips", {"vertex_index", "vertex_indices"}},
        {"material", {"ambient_red", "ambient_green", "ambient_blue", "ambient_alpha", "diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha", "specular_red", "specular_green",
                      "specular_blue", "specular_alpha", "opacity", "specular_power"}}};
    const auto known = kShown.find(element);
    return known != kShown.end() && known->second.contains(property);
}

std::string someOf(const std::vector<std::string>& names) {
    const std::size_t named = std::min(names.size(), kMostNamed);
    const std::string some = fmt::format("{}", fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(named), ", "));
    return names.size() > named ? fmt::format("{} and {} more", some, names.size() - named) : some;
}

void noteFurther(const PlyFile& file, std::vector<std::string>& notes) {
    std::vector<std::string> wholly;
    const bool joins = file.joinsFaces();  // and nothing but corners is left of them
    for (const PlyElement& element : file.elements()) {
        std::vector<std::string> further;
        for (const PlyProperty& property : element.properties)
            if (!isShown(element.name, property.name) || (joins && property.name == "texcoord" && element.isOfFaces())) further.push_back(property.name);
        if (element.count == 0 || further.empty()) continue;
        if (further.size() == element.properties.size()) wholly.push_back(fmt::format("{} {} ({})", element.count, element.name, someOf(further)));
        else notes.push_back(fmt::format("{} of each {} {} left out", someOf(further), element.name, further.size() == 1 ? "is" : "are"));
    }
    if (!wholly.empty()) notes.push_back(fmt::format("further elements are left out: {}", someOf(wholly)));
}

/// Assimp puts 0 where a vertex says nothing.
Expected<void> checkPlaces(const std::vector<PlyElement>& elements) {
    const auto vertices = std::ranges::find_if(elements, [](const PlyElement& element) { return element.isOfVertices() && element.count > 0; });
    if (vertices == elements.end()) return {};
    std::vector<std::string> missing;
    for (const char* const axis : {"x", "y", "z"})
        if (std::ranges::none_of(vertices->properties, [&](const PlyProperty& property) { return !property.isList && property.name == axis; })) missing.emplace_back(axis);
    if (missing.empty()) return {};
    return fail(ErrorCode::kBadInput, fmt::format("line {}: the element vertex has no {}", vertices->line, fmt::join(missing, ", ")));
}

Expected<void> noteCut(const PlyFile& file, std::vector<std::string>& notes) {
    const PlyElement* const cut = file.cut();
    if (cut == nullptr) return {};
    const std::vector<PlyElement>& elements = file.elements();
    const auto faces = std::ranges::find_if(elements, [](const PlyElement& element) { return element.isOfFaces() && element.count > 0; });
    const bool isCloud = faces == elements.end();
    std::string what = fmt::format("its header announces {} {} (line {}), and {} of them {} there: it is cut off", cut->count, cut->name, cut->line, cut->there, cut->there == 1 ? "is" : "are");
    // Without all vertices, or any faces, there is no mesh; of a cloud each point is good.
    const bool isLost = isCloud ? cut->isOfVertices() && cut->there == 0 : !(faces->there > 0 && (cut->isOfFaces() || cut > &*faces));
    const bool beforeVertices = std::ranges::none_of(elements, [](const PlyElement& element) { return element.isOfVertices() && element.there > 0; });
    if (isLost || beforeVertices) return fail(ErrorCode::kBadInput, what);
    notes.push_back(std::move(what));
    return {};
}

Expected<void> noteRows(const PlyFile& file, std::vector<std::string>& notes) {
    std::uint64_t left = 0;
    std::string first;
    for (const PlyElement& element : file.elements()) {
        if (element.lacking > 0)
            notes.push_back(fmt::format("{} of {} vertices {} fewer numbers than the header asks for; the first, {}", element.lacking, element.there, element.lacking == 1 ? "has" : "have",
                                        element.firstLacking));
        if (!element.isOfFaces()) continue;
        left += element.there - element.leftOut;
        if (element.leftOut == 0) continue;
        notes.push_back(fmt::format("{} of {} {} {} left out; the first, {}", element.leftOut, element.there, element.isStrips() ? "strips" : "faces", element.leftOut == 1 ? "is" : "are",
                                    element.firstLeftOut));
        if (first.empty()) first = notes.back();
    }
    if (left == 0 && !first.empty()) return fail(ErrorCode::kBadInput, first);
    return {};
}

}  // namespace

Expected<bool> mendPly(Bytes& bytes, std::vector<std::string>& notes) {
    PlyFile file(asText(bytes));
    if (Expected<void> head = file.readHeader(); !head) return tl::unexpected(head.error());
    noteFurther(file, notes);
    if (!file.isKnown()) {
        if (Expected<void> holds = file.checkLeast(); !holds) return tl::unexpected(holds.error());
        return false;
    }
    Expected<void> sound = file.count();
    if (sound) sound = noteCut(file, notes);
    if (sound) sound = checkPlaces(file.elements());
    if (sound) sound = noteRows(file, notes);
    if (!sound) return tl::unexpected(sound.error());
    if (file.doubtfulLine() > 0) notes.push_back(doubtOfLastLine(file.doubtfulLine()));
    if (std::string behind = file.behind(); file.cut() == nullptr && !behind.empty()) notes.push_back(std::move(behind));
    if (!file.toBeWritten()) return false;
    bytes = file.written();
    return true;
}

}  // namespace tessera
