// Statements of an OBJ that assimp would refuse the whole file for.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/TextLines.h"

namespace tessera {
namespace {

/// Goes through statements with what has been declared so far: lines, joined where a backslash ends one.
class ObjStatements {
public:
    explicit ObjStatements(std::string_view text) : text_(text) {}

    bool next() {
        if (at_ >= text_.size()) return false;
        begin_ = at_;
        line_ = nextLine_;
        joined_.clear();
        for (bool goesOn = true; goesOn && at_ < text_.size();) {
            const std::size_t end = std::min(text_.find('\n', at_), text_.size());
            std::string_view part = text_.substr(at_, end - at_);
            at_ = std::min(end + 1, text_.size());
            ++nextLine_;
            if (part.ends_with('\r')) part.remove_suffix(1);
            const std::size_t first = part.find_first_not_of(" \t\v\f");
            const bool isRemark = joined_.empty() && first != part.npos && part[first] == '#';
            goesOn = part.ends_with('\\') && !isRemark;
            if (goesOn || !joined_.empty())
                joined_.append(part.substr(0, part.size() - (goesOn ? 1 : 0))).push_back(' ');
            else
                whole_ = part;
        }
        return true;
    }
    /// Without remarks.
    [[nodiscard]] std::string_view statement() const {
        const std::string_view all = joined_.empty() ? whole_ : std::string_view(joined_);
        return all.substr(0, all.find('#'));
    }
    [[nodiscard]] std::size_t begin() const { return begin_; }
    [[nodiscard]] std::size_t end() const { return at_; }
    [[nodiscard]] std::size_t line() const { return line_; }

private:
    std::string_view text_, whole_;
    std::string joined_;
    std::size_t at_ = 0, begin_ = 0, line_ = 1, nextLine_ = 1;
};

bool declares(std::string_view statement, std::string_view key) {
    return statement.size() > key.size() && statement.starts_with(key) &&
           (statement[key.size()] == ' ' || statement[key.size()] == '\t');
}

/// Of "v x y z …". Words that are no numbers are left to assimp.
bool isFinite(std::string_view statement) {
    if (statement.find_first_of("nNiIeE") == statement.npos) return true;
    TextLines lines(statement);
    std::vector<std::string_view> words;
    (void)lines.next(words);
    for (std::size_t i = 1; i < std::min<std::size_t>(words.size(), 4); ++i) {
        float value = 0;
        const std::string_view word = words[i].starts_with('+') ? words[i].substr(1) : words[i];
        const char* const last = word.data() + word.size();
        const std::errc error = std::from_chars(word.data(), last, value).ec;
        if (error == std::errc() && !std::isfinite(value)) return false;
        if (error != std::errc::result_out_of_range) continue;
        double wide = 0;  // too small for a float, or too large
        const bool small = std::from_chars(word.data(), last, wide).ec == std::errc() && std::abs(wide) < 1;
        const std::size_t exponent = word.find_first_of("eE");
        if (!small && word.substr(std::min(exponent, word.size() - 1) + 1).starts_with('-'))
            continue;  // for a double, too
        if (!small) return false;
    }
    return true;
}

std::string_view keyOf(std::string_view statement) {
    statement.remove_prefix(std::min(statement.find_first_not_of(" \t\v\f"), statement.size()));
    return statement.substr(0, statement.find_first_of(" \t\v\f"));
}

/// Of them nothing is shown.
constexpr std::array<std::string_view, 12> kUnread{"curv",  "scrv", "sp",  "con", "mg",  "ctech",
                                                   "stech", "bzp",  "bsp", "cdc", "cdp", "res"};
/// What else is of curves and surfaces.
constexpr std::array<std::string_view, 11> kOfFreeform{"cstype", "deg",  "bmat", "step", "vp", "surf",
                                                       "curv2",  "parm", "trim", "hole", "end"};

}  // namespace

bool isOfFreeform(std::string_view key) {
    return std::ranges::find(kUnread, key) != kUnread.end() || std::ranges::find(kOfFreeform, key) != kOfFreeform.end();
}

namespace {

class ObjMending {
public:
    explicit ObjMending(Bytes& bytes) : bytes_(bytes), text_(asText(bytes)) {}

    bool mend(std::vector<std::string>& notes, std::vector<std::string>* missing) {
        writeOutZeros();
        for (ObjStatements s(text_); s.next();) {
            if (declares(s.statement(), "v")) finite_.push_back(isFinite(s.statement()));
            if (declares(s.statement(), "vt")) ++texcoords_;
        }
        if (std::string note = noteOfFreeform(text_); !note.empty()) notes.push_back(std::move(note));
        for (ObjStatements s(text_); s.next();)
            if (isOfFreeform(keyOf(s.statement()))) blank(s.begin(), s.end());
        std::size_t seen = 0, seenTexcoords = 0, wrong = 0, all = 0;
        std::string first;
        std::vector<std::string_view> words;
        for (ObjStatements s(text_); s.next();) {
            const std::string_view statement = s.statement();
            if (declares(statement, "v")) ++seen;
            if (declares(statement, "vt")) ++seenTexcoords;
            if (!declares(statement, "f") && !declares(statement, "l") && !declares(statement, "p")) continue;
            ++all;
            TextLines(statement).next(words);
            std::string why;
            for (std::size_t i = 1; i < words.size() && why.empty(); ++i) why = faultOf(words[i], seen, seenTexcoords);
            if (why.empty()) {
                const std::size_t remark = text_.substr(s.begin(), s.end() - s.begin()).find('#');
                if (remark != text_.npos) blank(s.begin() + remark, s.end());
                continue;
            }
            if (wrong++ == 0) first = fmt::format("line {}: {}", s.line(), why);
            blank(s.begin(), s.end());
        }
        if (wrong > 0)
            notes.push_back(fmt::format("{} of {} faces, lines and points {} left out; the first, {}", wrong, all,
                                        wrong == 1 ? "is" : "are", first));
        if (wrong > 0 && missing != nullptr) missing->push_back(notes.back());
        return changed_;
    }

private:
    /// Assimp takes `.5` for no number, and the vertex for none.
    void writeOutZeros() {
        Bytes written;
        std::size_t done = 0;
        for (std::size_t at = text_.find('.'); at != text_.npos; at = text_.find('.', at + 1)) {
            const bool begins = at > 0 && (text_[at - 1] == ' ' || text_[at - 1] == '\t');
            if (!begins || at + 1 >= text_.size() || text_[at + 1] < '0' || text_[at + 1] > '9') continue;
            std::size_t line = text_.rfind('\n', at) + 1;  // npos + 1 is 0
            line = text_.find_first_not_of(" \t", line);
            if (text_[line] != 'v') continue;
            written.insert(written.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(done),
                           bytes_.begin() + static_cast<std::ptrdiff_t>(at));
            written.push_back(std::byte{'0'});
            done = at;
        }
        if (done == 0) return;
        written.insert(written.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(done), bytes_.end());
        bytes_ = std::move(written);
        changed_ = true;
        text_ = asText(bytes_);
    }
    /// Of a corner, VERTEX/TEXTURE/NORMAL; numbers from 1, or back from -1. Of normals that do not exist assimp makes
    /// others itself.
    std::string faultOf(std::string_view word, std::size_t seen, std::size_t seenTexcoords) const {
        const auto index = [](std::string_view number, std::size_t soFar, std::size_t all) -> std::int64_t {
            std::int64_t value = 0;
            if (!isNumber(number, value) || value == 0) return -1;
            const std::int64_t at = value > 0 ? value - 1 : static_cast<std::int64_t>(soFar) + value;
            return at < static_cast<std::int64_t>(all) ? at : -1;
        };
        const std::size_t slash = word.find('/');
        const std::int64_t vertex = index(word.substr(0, slash), seen, finite_.size());
        if (vertex < 0) return fmt::format("'{}' names none of the {} vertices", word.substr(0, 40), finite_.size());
        if (!finite_[static_cast<std::size_t>(vertex)])
            return fmt::format("'{}' names a vertex whose position is not finite", word.substr(0, 40));
        if (slash == word.npos || texcoords_ == 0) return {};
        const std::string_view rest = word.substr(slash + 1);
        const std::string_view texture = rest.substr(0, rest.find('/'));
        if (!texture.empty() && index(texture, seenTexcoords, texcoords_) < 0)
            return fmt::format("'{}' names none of the {} texture coordinates", word.substr(0, 40), texcoords_);
        return {};
    }
    /// Lines stay lines: those that follow keep their numbers.
    void blank(std::size_t begin, std::size_t end) {
        changed_ = true;
        for (std::size_t at = begin; at < end; ++at)
            if (bytes_[at] != std::byte{'\n'} && bytes_[at] != std::byte{'\r'}) bytes_[at] = std::byte{' '};
    }

    Bytes& bytes_;
    std::string_view text_;
    std::vector<bool> finite_;
    std::size_t texcoords_ = 0;
    bool changed_ = false;
};

}  // namespace

std::string doubtOfVertices(std::string_view text) {
    std::vector<std::string_view> words;
    for (ObjStatements s(text); s.next();) {
        if (!declares(s.statement(), "v")) continue;
        TextLines(s.statement()).next(words);
        if (words.size() < 4)
            return fmt::format("line {}: a vertex has three numbers, not {}", s.line(), words.size() - 1);
        for (std::size_t i = 1; i < 4; ++i)
            if (double value = 0; !isReal(words[i], value))
                return fmt::format("line {}: '{}' is no number", s.line(), words[i].substr(0, 40));
    }
    return {};
}

std::string noteOfFreeform(std::string_view text) {
    struct Seen {
        std::size_t count = 0, line = 0;
        void add(std::size_t at) {
            if (count++ == 0) line = at;
        }
    };
    std::map<std::string_view, Seen> seen;
    std::vector<std::size_t> curves;  // lines of curv2
    std::set<std::size_t> taken;      // of these
    std::vector<std::string_view> words;
    for (ObjStatements s(text); s.next();) {
        const std::string_view key = keyOf(s.statement());
        if (key == "curv2") curves.push_back(s.line());
        if (!isOfFreeform(key)) continue;
        const std::string statement(s.statement());
        TextLines(statement).next(words);
        for (std::size_t i = 3; (key == "trim" || key == "hole") && i < words.size(); i += 3) {
            std::int64_t number = 0;
            if (!isNumber(words[i], number)) continue;
            taken.insert(
                static_cast<std::size_t>(number > 0 ? number - 1 : static_cast<std::int64_t>(curves.size()) + number));
        }
        const bool none = key == "mg" && words.size() > 1 && (words[1] == "0" || words[1] == "off");
        if (const auto unread = std::ranges::find(kUnread, key); unread != kUnread.end() && !none)
            seen[*unread].add(s.line());
    }
    for (std::size_t i = 0; i < curves.size(); ++i)
        if (!taken.contains(i)) seen["curv2"].add(curves[i]);
    std::vector<std::string> names;
    for (const auto& [key, of] : seen)
        names.push_back(fmt::format("{} ({})", key,
                                    of.count == 1 ? fmt::format("line {}", of.line)
                                                  : fmt::format("{}, the first in line {}", of.count, of.line)));
    return names.empty() ? std::string() : fmt::format("free-form statements are left out: {}", fmt::join(names, ", "));
}

bool mendObj(Bytes& bytes, std::vector<std::string>& notes, std::vector<std::string>* missing) {
    return ObjMending(bytes).mend(notes, missing);
}

}  // namespace tessera
