#include "server/import/reader/BeforeAssimp.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "common/base/LowerCase.h"
#include "server/import/reader/TextLines.h"

namespace tessera {
namespace {

tl::unexpected<Error> failInLine(std::size_t line, std::string_view what) {
    return fail(ErrorCode::kBadInput, fmt::format("line {}: {}", line, what));
}

}  // namespace

Expected<void> checkSmd(std::string_view text, std::vector<std::string>& notes) {
    // A bone takes a line, so there are no more of them.
    const auto most = static_cast<std::uint64_t>(std::ranges::count(text, '\n')) + 1;
    TextLines lines(text);
    std::vector<std::string_view> words;
    std::string section;
    std::size_t begun = 0, corner = 0;
    while (lines.next(words)) {
        if (words[0].starts_with("//") || words[0].starts_with('#') || words[0].starts_with(';')) continue;
        if (section.empty()) {
            if (words[0] == "version") continue;
            section = words[0];
            begun = lines.line();
            corner = 0;
            continue;
        }
        if (words[0] == "end") {
            section.clear();
            continue;
        }
        if (section == "nodes") {
            std::uint64_t bone = 0;
            std::int64_t parent = 0;
            if (words.size() < 3 || !isNumber(words[0], bone) || bone >= most)
                return failInLine(lines.line(), "this is no bone: a number, a name, its parent's number");
            if (!isNumber(words[2], parent) || parent < -1 || parent >= static_cast<std::int64_t>(most))
                return failInLine(lines.line(), "a bone's parent is the number of a bone, or -1");
        } else if (section == "triangles" && corner++ % 4 != 0) {  // the name of a picture, then three corners
            std::uint64_t links = 0;
            if (words.size() < 10 || !isNumber(words[9], links)) continue;
            if (links > words.size() || words.size() < 10 + 2 * links)
                return failInLine(lines.line(), fmt::format("a corner announces {} bones, and names {}", links,
                                                            (words.size() - 10) / 2));
        }
    }
    // It goes on for ever in this one alone.
    if (section == "nodes") return failInLine(begun, "the section 'nodes' has no end");
    if (!section.empty())
        notes.push_back(
            fmt::format("the section '{}' (line {}) has no end: it is cut off", section.substr(0, 40), begun));
    return {};
}

namespace {

/// For a message.
std::string_view wordAt(const std::vector<std::string_view>& words, std::size_t at) {
    return at < words.size() ? words[at].substr(0, 40) : std::string_view();
}

/// One mesh of an MD5, as far as its numbers have to fit together.
class Md5MeshCheck {
public:
    Md5MeshCheck(std::size_t joints, std::size_t lines) : joints_(joints), mostItems_(lines) {}

    Expected<void> line(const std::vector<std::string_view>& words, std::size_t at) {
        const auto number = [&](std::size_t word) {
            std::uint64_t value = 0;
            return word < words.size() && isNumber(words[word], value) ? std::optional(value) : std::nullopt;
        };
        const auto sized = [&](Items& items) -> Expected<void> {
            const std::optional<std::uint64_t> said = number(1);
            if (!said || *said > mostItems_)
                return failInLine(at, fmt::format("{} is more than the file has lines", words[0]));
            items = {std::vector<bool>(*said), at};
            return {};
        };
        const auto declared = [&](Items& items, const char* of) -> Expected<std::uint64_t> {
            const std::optional<std::uint64_t> said = number(1);
            if (!said || *said >= items.there.size())
                return failInLine(at, fmt::format("'{}' names none of the {} {} announced", wordAt(words, 1),
                                                  items.there.size(), of));
            items.there[*said] = true;
            return *said;
        };
        const auto within = [&](std::size_t word, std::uint64_t count, const char* of) -> Expected<std::uint64_t> {
            const std::optional<std::uint64_t> said = number(word);
            if (said && *said < count) return *said;
            return failInLine(at, fmt::format("'{}' names none of the {} {}", wordAt(words, word), count, of));
        };
        if (words[0] == "numverts") return sized(verts_);
        if (words[0] == "numtris") return sized(tris_);
        if (words[0] == "numweights") return sized(weights_);
        if (words[0] == "vert") {  // vert NUMBER ( u v ) FIRST-WEIGHT WEIGHTS
            const Expected<std::uint64_t> which = declared(verts_, "vertices");
            if (!which) return tl::unexpected(which.error());
            const std::optional<std::uint64_t> first = number(words.size() - 2), count = number(words.size() - 1);
            if (words.size() < 4 || !first || !count)
                return failInLine(at, "a vertex names its first weight and how many it has");
            moved_.push_back({*first, *count, at});
        }
        if (words[0] == "tri") {  // tri NUMBER A B C
            if (const Expected<std::uint64_t> which = declared(tris_, "triangles"); !which)
                return tl::unexpected(which.error());
            for (std::size_t corner = 2; corner < 5; ++corner)
                if (const Expected<std::uint64_t> vertex = within(corner, verts_.there.size(), "vertices"); !vertex)
                    return tl::unexpected(vertex.error());
        }
        if (words[0] == "weight") {  // weight NUMBER JOINT WEIGHT ( x y z )
            const Expected<std::uint64_t> which = declared(weights_, "weights");
            if (!which) return tl::unexpected(which.error());
            if (const Expected<std::uint64_t> joint = within(2, joints_, "joints"); !joint)
                return tl::unexpected(joint.error());
            float weight = 0;
            if (words.size() > 3) (void)isNumber(words[3], weight);
            if (values_.size() <= *which) values_.resize(*which + 1);
            values_[*which] = weight;
        }
        return {};
    }
    /// At the mesh's end. Adds to the vertices that nothing moves, and keeps the line of the first.
    Expected<void> end(std::size_t& unmoved, std::size_t& firstUnmoved) const {
        for (const auto& [items, of] :
             {std::pair(&verts_, "vertices"), std::pair(&tris_, "triangles"), std::pair(&weights_, "weights")})
            if (const auto missing = std::ranges::find(items->there, false); missing != items->there.end())
                return failInLine(items->line, fmt::format("of the {} {} announced number {} is not there",
                                                           items->there.size(), of, missing - items->there.begin()));
        const std::uint64_t weights = weights_.there.size();
        for (const Moved& vertex : moved_) {
            if (vertex.count > weights || vertex.first > weights - vertex.count)
                return failInLine(vertex.line,
                                  fmt::format("its {} weights from number {} on are not among the {} there are",
                                              vertex.count, vertex.first, weights));
            double sum = 0;
            for (std::uint64_t w = vertex.first; w < vertex.first + vertex.count && w < values_.size(); ++w)
                sum += values_[w];
            if (!(std::abs(sum) > 1e-20) && unmoved++ == 0) firstUnmoved = vertex.line;
        }
        return {};
    }

private:
    struct Moved {
        std::uint64_t first, count;
        std::size_t line;
    };
    struct Items {
        std::vector<bool> there = {};  ///< by number
        std::size_t line = 0;          ///< that announced them
    };
    std::uint64_t joints_, mostItems_;
    Items verts_, tris_, weights_;
    std::vector<Moved> moved_;
    std::vector<float> values_;
};

/// What is behind a name in quotes; `//` begins a remark outside of them.
void cutRemark(std::vector<std::string_view>& words) {
    const auto remark = std::ranges::find_if(words, [](std::string_view word) { return word.starts_with("//"); });
    words.erase(remark, words.end());
}

}  // namespace

Expected<void> checkMd5Mesh(std::string_view text, std::vector<std::string>& notes) {
    const auto most =
        static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return c == '\n' || c == '\r'; })) + 1;
    TextLines lines(text);
    std::vector<std::string_view> words;
    std::size_t joints = 0, unmoved = 0, firstUnmoved = 0, begun = 0;
    std::string section;
    std::optional<Md5MeshCheck> mesh;
    while (lines.next(words)) {
        cutRemark(words);
        if (words.empty()) continue;
        if (section.empty()) {
            if (words.size() > 1 && words[1] == "{") {
                section = words[0];
                begun = lines.line();
                if (section == "mesh") mesh.emplace(joints, most);
            }
            continue;
        }
        if (words[0] == "}") {
            if (mesh)
                if (Expected<void> sound = mesh->end(unmoved, firstUnmoved); !sound) return sound;
            mesh.reset();
            section.clear();
            continue;
        }
        if (section == "joints" && words[0].starts_with('"')) {
            ++joints;
            std::int64_t parent = 0;
            if (words.size() < 2 || !isNumber(words[1], parent) || parent < -1 ||
                parent >= static_cast<std::int64_t>(most))
                return failInLine(lines.line(), "a joint's parent is the number of a joint, or -1");
        }
        if (mesh)
            if (Expected<void> sound = mesh->line(words, lines.line()); !sound) return sound;
    }
    if (!section.empty()) return failInLine(begun, fmt::format("the section '{}' has no end", section.substr(0, 40)));
    if (unmoved > 0)
        notes.push_back(
            fmt::format("the weights of {} {} to nothing (the first: line {}): no joint moves what they belong to",
                        unmoved, unmoved == 1 ? "vertex sum up" : "vertices sum up", firstUnmoved));
    return {};
}

Expected<void> checkMd5Animation(std::string_view text) {
    TextLines lines(text);
    std::vector<std::string_view> words;
    std::string section;
    std::size_t begun = 0;
    std::uint64_t bones = 0, poses = 0, needed = 0, numbers = 0;
    while (lines.next(words)) {
        cutRemark(words);
        if (words.empty()) continue;
        if (section.empty()) {
            if (words.back() != "{") continue;
            section = words[0];
            begun = lines.line();
            numbers = 0;
            continue;
        }
        if (words[0] == "}") {
            if (section == "baseframe" && poses < bones)
                return failInLine(begun, fmt::format("{} joints, and a base frame of {}", bones, poses));
            if (section == "frame" && numbers < needed)
                return failInLine(
                    begun, fmt::format("the hierarchy asks for {} numbers a frame, and here are {}", needed, numbers));
            section.clear();
            continue;
        }
        if (section == "hierarchy") {  // "NAME" PARENT FLAGS FIRST
            std::int64_t parent = 0;
            std::uint32_t flags = 0, first = 0;
            if (words.size() < 4 || !isNumber(words[1], parent) || parent < -1 || !isNumber(words[2], flags) ||
                !isNumber(words[3], first))
                return failInLine(lines.line(),
                                  "this is no joint: a name, its parent, which numbers move it, the first of them");
            ++bones;
            if (flags != 0)
                needed = std::max(needed,
                                  std::uint64_t{first} + static_cast<std::uint64_t>(__builtin_popcount(flags & 0x3f)));
        }
        if (section == "baseframe") ++poses;
        if (section == "frame") numbers += words.size();
    }
    if (!section.empty()) return failInLine(begun, fmt::format("the section '{}' has no end", section.substr(0, 40)));
    if (bones > 0 && poses < bones)
        return fail(ErrorCode::kBadInput, fmt::format("{} joints, and a base frame of {}", bones, poses));
    return {};
}

bool BeforeAssimp::lets(const std::string& path, Bytes& bytes) {
    if (sound_.contains(path)) return true;  // assimp opens a file several times
    const std::string ending = lowerCase(path.substr(std::min(path.rfind('.') + 1, path.size())));
    const std::string_view text = asText(bytes);
    Expected<void> sound;
    std::vector<std::string> said, missing;
    bool changed = false;
    const auto mended = [&](const Expected<bool>& outcome) {
        if (outcome)
            changed = *outcome;
        else
            sound = tl::unexpected(outcome.error());
    };
    if (ending == "ply") mended(mendPly(bytes, said, &missing));
    if (ending == "stl") mended(mendStl(bytes, said, &missing));
    if (ending == "off") mended(mendOff(bytes, said, &missing));
    if (ending == "obj") doubt_ = doubtOfVertices(text);
    if (ending == "obj") objNames_.add(text);
    if (ending == "obj") changed = mendObj(bytes, said, &missing);
    if (ending == "smd" || ending == "vta") sound = checkSmd(text, missing);
    if (ending == "md5mesh") sound = checkMd5Mesh(text, said);
    if (ending == "md5anim") sound = checkMd5Animation(text);
    if (!sound && !refusal_) {
        refusal_ = sound.error();
        refusal_->message =
            fmt::format("'{}' cannot be read: {}", path.substr(path.rfind('/') + 1), sound.error().message);
    }
    if (!sound) return false;
    if (!changed) sound_.insert(path);
    if (ending == "smd" || ending == "vta") said = missing;
    missing_.insert(missing_.end(), missing.begin(), missing.end());
    for (std::string& note : said)
        if (std::ranges::find(notes_, note) == notes_.end()) notes_.push_back(std::move(note));
    return true;
}

}  // namespace tessera
