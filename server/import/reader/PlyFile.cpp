#include "server/import/reader/PlyFile.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <span>

#include "server/import/reader/TextLines.h"

namespace tessera {
namespace {

PlyType typeNamed(std::string_view name) {
    static const std::map<std::string_view, PlyType> kTypes = {
        {"char", {1}},        {"int8", {1}},          {"uchar", {1, false, false}},  {"uint8", {1, false, false}},
        {"short", {2}},       {"int16", {2}},         {"ushort", {2, false, false}}, {"uint16", {2, false, false}},
        {"int", {4}},         {"int32", {4}},         {"uint", {4, false, false}},   {"uint32", {4, false, false}},
        {"float", {4, true}}, {"float32", {4, true}}, {"double", {8, true}},         {"float64", {8, true}}};
    const auto known = kTypes.find(name);
    return known == kTypes.end() ? PlyType() : known->second;
}

struct RowFault {
    std::string why;           ///< empty: there is none
    std::size_t property = 0;  ///< where it is; all before are good
    bool isShort = false;      ///< the row ends there
};

/// Of one corner assimp would make a point, and of that a ball.
bool isNoFace(const PlyElement& element, const PlyProperty& property, double corners) {
    return element.name == "face" && (property.name == "vertex_index" || property.name == "vertex_indices") &&
           corners < 2;
}
std::string cornersText(double corners) {
    return corners == 1 ? "it has one corner" : "it has no corners";
}

/// What keeps the words from being a row of the element. Of elements that nobody shows their number alone matters.
/// `needed`: of words.
RowFault rowFault(std::span<const std::string_view> words, const PlyElement& element, std::size_t& needed) {
    const bool shown = element.isOfVertices() || element.isOfFaces();
    const auto isNone = [&](std::string_view word, double& value) { return shown && !isReal(word, value); };
    needed = 0;
    double value = 0;
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
        if (needed >= words.size())
            return {fmt::format("it has {} numbers of {}", words.size(), element.properties.size()), p, true};
        if (!element.properties[p].isList) {
            if (isNone(words[needed], value)) return {fmt::format("'{}' is no number", words[needed].substr(0, 40)), p};
            ++needed;
            continue;
        }
        double length = -1;
        if (!isReal(words[needed], length) || !(length >= 0))
            return {fmt::format("'{}' is no number of corners", words[needed].substr(0, 40)), p};
        if (isNoFace(element, element.properties[p], length)) return {cornersText(length), p};
        const std::size_t left = words.size() - ++needed;
        if (length > static_cast<double>(left))
            return {fmt::format("it says {} corners, and has {}", length, left), p, true};
        for (const std::size_t end = needed + static_cast<std::size_t>(length); needed < end; ++needed)
            if (isNone(words[needed], value)) return {fmt::format("'{}' is no number", words[needed].substr(0, 40)), p};
    }
    return {};
}

/// Whether the first `properties` of it say where a vertex is.
bool sayPlace(const PlyElement& element, std::size_t properties) {
    const auto isPlace = [](const PlyProperty& property) {
        return !property.isList && (property.name == "x" || property.name == "y" || property.name == "z");
    };
    return std::ranges::count_if(std::span(element.properties).first(properties), isPlace) == 3;
}

}  // namespace

Expected<void> PlyFile::readHeader() {
    TextLines lines(bytes_);
    std::vector<std::string_view> words;
    const auto failInLine = [&](const char* why) {
        return fail(ErrorCode::kBadInput, fmt::format("line {}: {}", lines.line(), why));
    };
    const auto at = [&](std::string_view word) { return static_cast<std::size_t>(word.data() - bytes_.data()); };
    for (bool ended = false; !ended;) {
        if (!lines.next(words)) return fail(ErrorCode::kBadInput, "its header does not end");
        if (words[0] == "format" && words.size() > 1)
            encoding_ = words[1] == "ascii"               ? Encoding::kText
                        : words[1] == "binary_big_endian" ? Encoding::kBigEndian
                                                          : Encoding::kLittleEndian;
        if (words[0] == "element") {
            std::uint64_t count = 0;
            if (words.size() != 3 || !isNumber(words[2], count))
                return failInLine("an element says its name and how many of it there are");
            PlyElement element{.name = std::string(words[1].substr(0, 40)), .count = count, .line = lines.line()};
            const bool again = element.isOfVertices() && std::ranges::any_of(elements_, [](const PlyElement& other) {
                                   return other.isOfVertices();
                               });
            if (again) return failInLine("a second element vertex");
            element.headBegin = at(words[0]);
            element.countBegin = at(words[2]);
            element.countEnd = element.countBegin + words[2].size();
            elements_.push_back(std::move(element));
        }
        if (words[0] == "property" && words.size() > 2 && !elements_.empty()) {
            PlyProperty property{.name = std::string(words.back().substr(0, 40)), .isList = words[1] == "list"};
            property.number = typeNamed(words[1]);
            property.line = lines.line();
            const std::size_t types = property.isList && words.size() > 3 ? 2 : 1;
            if (types == 2) {
                property.length = typeNamed(words[2]);
                property.number = typeNamed(words[3]);
            }
            for (std::size_t t = types; t > 0; --t)
                if (const std::string_view type = words[types == 2 ? t + 1 : 1]; typeNamed(type).bytes == 0)
                    property.unknownType = type.substr(0, 40);
            const auto isSame = [&](const PlyProperty& other) { return other.name == property.name; };
            if (elements_.back().isOfVertices() && std::ranges::any_of(elements_.back().properties, isSame))
                return failInLine("the element vertex has this property already");
            elements_.back().properties.push_back(std::move(property));
        }
        ended = words[0] == "end_header";
        headEnd_ = at(words[0]);
    }
    body_ = bytes_.size() - lines.bytesLeft();
    line_ = lines.line();
    for (const PlyElement& element : elements_)
        if (element.count > 0 && element.properties.empty())
            return fail(ErrorCode::kBadInput,
                        fmt::format("line {}: the element {} has no properties", element.line, element.name));
    return {};
}

Expected<void> PlyFile::count() {
    at_ = body_;
    for (PlyElement& element : elements_) {
        element.begin = element.end = at_;
        Expected<void> counted = isText() ? countLines(element) : countRows(element);
        if (!counted) return counted;
        element.end = at_;
        if (element.there < element.count) break;
    }
    if (joinsFaces()) faces_ = joinedFaces();
    return {};
}

std::string PlyFile::emptyStrips() const {
    if (faces_.emptyStrips == 0) return {};
    return fmt::format("{} of {} strips {} no triangle; the first, number {}", faces_.emptyStrips, faces_.strips,
                       faces_.emptyStrips == 1 ? "has" : "have", faces_.firstEmpty);
}

const PlyElement* PlyFile::cut() const {
    const auto found =
        std::ranges::find_if(elements_, [](const PlyElement& element) { return element.there < element.count; });
    return found == elements_.end() ? nullptr : &*found;
}

std::string PlyFile::behind() const {
    const std::string_view rest = bytes_.substr(at_);
    const std::size_t first = rest.find_first_not_of(" \t\r\n");
    if (encoding_ == Encoding::kText) {
        if (first == rest.npos) return {};
        const auto line = line_ + 1 + static_cast<std::size_t>(std::ranges::count(rest.substr(0, first), '\n'));
        return fmt::format("what is behind all that its header announces is left out (line {})", line);
    }
    if (rest.empty() || rest == "\n" || rest == "\r\n") return {};
    return fmt::format("{} {} behind all that its header announces {} left out", rest.size(),
                       rest.size() == 1 ? "byte" : "bytes", rest.size() == 1 ? "is" : "are");
}

bool PlyFile::joinsFaces() const {
    const auto isThere = [](const PlyElement& element) { return element.isOfFaces() && element.count > 0; };
    return std::ranges::count_if(elements_, isThere) > 1 ||
           std::ranges::any_of(elements_,
                               [&](const PlyElement& element) { return isThere(element) && element.isStrips(); });
}

bool PlyFile::toBeWritten() const {
    return cut() != nullptr || joinsFaces() ||
           std::ranges::any_of(elements_, [](const PlyElement& element) { return !element.gaps.empty(); });
}

/// Each element takes a line. Assimp takes an empty one for a row, if another is before it.
Expected<void> PlyFile::countLines(PlyElement& element) {
    std::vector<std::string_view> words;
    for (; element.there < element.count; ++element.there) {
        std::size_t begin = at_, end = at_, line = line_;
        for (;; begin = end + 1) {
            if (begin >= bytes_.size()) return {};
            end = std::min(bytes_.find('\n', begin), bytes_.size());
            ++line;
            if (bytes_.substr(begin, end - begin).find_first_not_of(" \t\v\f\r") != std::string_view::npos) break;
        }
        (void)TextLines(bytes_.substr(begin, end - begin)).next(words);
        std::size_t needed = 0;
        const auto [fault, property, isShort] = rowFault(words, element, needed);
        const bool last = end == bytes_.size();
        if (last && !fault.empty()) return {};
        const bool isPlaced = isShort && sayPlace(element, property);
        if (element.isOfVertices() && !fault.empty()) {
            if (!isPlaced)
                return fail(ErrorCode::kBadInput, fmt::format("line {}: this is no vertex: {}", line, fault));
            if (element.lacking++ == 0) element.firstLacking = fmt::format("line {}: {}", line, fault);
        }
        if (last && words[needed - 1].data() + words[needed - 1].size() == bytes_.data() + bytes_.size())
            doubtfulLine_ = line;
        if (fault.empty() && words.size() > needed && (element.isOfVertices() || element.isOfFaces()) &&
            element.longer++ == 0)
            element.firstLonger = line;
        if (begin > at_) element.gaps.emplace_back(at_, begin);
        at_ = std::min(end + 1, bytes_.size());
        line_ = line;
        if (fault.empty() || !element.isOfFaces()) continue;
        element.gaps.emplace_back(begin, at_);
        if (element.leftOut++ == 0) element.firstLeftOut = fmt::format("line {}: {}", line, fault);
    }
    return {};
}

Expected<void> PlyFile::countRows(PlyElement& element) {
    const bool even = std::ranges::none_of(element.properties, &PlyProperty::isList);
    if (even) {
        std::size_t row = 0;
        for (const PlyProperty& property : element.properties) row += property.number.bytes;
        element.there = row == 0 ? element.count : std::min<std::uint64_t>(element.count, (bytes_.size() - at_) / row);
        at_ += element.there * row;
        return {};
    }
    for (; element.there < element.count; ++element.there) {
        std::size_t at = at_;
        std::optional<std::uint64_t> fewCorners;
        for (const PlyProperty& property : element.properties) {
            std::uint64_t many = 1;
            if (property.isList) {
                if (property.length.bytes > bytes_.size() - at) return {};
                // Where the next row begins nobody knows then.
                const double said = numberAt(at, property.length);
                if (!(said >= 0))
                    return fail(ErrorCode::kBadInput,
                                fmt::format("its {} number {} says that its list {} has {} numbers", element.name,
                                            element.there, property.name, said));
                many = lengthAt(at, property.length);
                at += property.length.bytes;
                if (isNoFace(element, property, static_cast<double>(many))) fewCorners = many;
            }
            if (many > (bytes_.size() - at) / property.number.bytes) return {};
            at += many * property.number.bytes;
        }
        if (fewCorners) {
            element.gaps.emplace_back(at_, at);
            if (element.leftOut++ == 0)
                element.firstLeftOut =
                    fmt::format("number {}: {}", element.there, cornersText(static_cast<double>(*fewCorners)));
        }
        at_ = at;
    }
    return {};
}

double PlyFile::numberAt(std::size_t at, const PlyType& type) const {
    std::array<char, 8> bytes{};
    std::copy_n(bytes_.data() + at, type.bytes, bytes.begin());
    if (encoding_ == Encoding::kBigEndian)
        std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(type.bytes));
    if (type.isFloat) {
        double wide = 0;
        std::memcpy(&wide, bytes.data(), sizeof(wide));
        float narrow = 0;
        std::memcpy(&narrow, bytes.data(), sizeof(narrow));
        return type.bytes == sizeof(narrow) ? narrow : wide;
    }
    std::uint32_t number = 0;
    std::memcpy(&number, bytes.data(), sizeof(number));
    if (!type.isSigned) return number;
    const auto unused = 32 - 8 * static_cast<std::uint32_t>(type.bytes);
    return static_cast<std::int32_t>(number << unused) >> unused;
}

std::uint64_t PlyFile::lengthAt(std::size_t at, const PlyType& type) const {
    const double length = numberAt(at, type);
    return length >= 0 && length < 1e15 ? static_cast<std::uint64_t>(length) : ~std::uint64_t{0};
}

void PlyFile::appendRows(const PlyElement& element, std::string& out) const {
    std::size_t from = element.begin;
    for (const auto& [begin, end] : element.gaps) {
        out.append(bytes_.substr(from, begin - from));
        from = end;
    }
    out.append(bytes_.substr(from, element.end - from));
    if (encoding_ == Encoding::kText && !out.ends_with('\n')) out.push_back('\n');
}

Bytes PlyFile::written() const {
    const bool joins = joinsFaces();
    std::string out(bytes_.substr(0, elements_.empty() ? headEnd_ : elements_.front().headBegin));
    bool isHeaded = false, areThere = false;
    for (std::size_t e = 0; e < elements_.size(); ++e) {
        const PlyElement& element = elements_[e];
        const std::size_t end = e + 1 < elements_.size() ? elements_[e + 1].headBegin : headEnd_;
        if (joins && element.isOfFaces()) {
            if (!std::exchange(isHeaded, true))
                out += fmt::format("element face {}\nproperty list uint int vertex_indices\n", faces_.count);
            continue;
        }
        out.append(bytes_.substr(element.headBegin, element.countBegin - element.headBegin))
            .append(std::to_string(element.there - element.leftOut));
        out.append(bytes_.substr(element.countEnd, end - element.countEnd));
    }
    out.append(bytes_.substr(headEnd_, body_ - headEnd_));
    for (const PlyElement& element : elements_) {
        if (!joins || !element.isOfFaces())
            appendRows(element, out);
        else if (!std::exchange(areThere, true))
            out.append(faces_.rows);
    }
    const ByteSpan made = asBytes(out);
    return Bytes(made.begin(), made.end());
}

PlyFile::Faces PlyFile::joinedFaces() const {
    Faces faces;
    std::vector<double> numbers;
    for (const PlyElement& element : elements_) {
        if (!element.isOfFaces()) continue;
        const auto list = std::ranges::find_if(element.properties, [&](const PlyProperty& property) {
            return property.isList &&
                   (element.isStrips() || property.name == "vertex_index" || property.name == "vertex_indices");
        });
        if (list == element.properties.end()) continue;
        const auto property = static_cast<std::size_t>(list - element.properties.begin());
        auto gap = element.gaps.begin();
        for (std::size_t at = element.begin; at < element.end;) {
            if (gap != element.gaps.end() && at == gap->first) {
                at = gap++->second;
                continue;
            }
            at = readList(element, property, at, numbers);
            std::vector<std::int32_t> corners;
            for (const double number : numbers)
                corners.push_back(std::abs(number) < 0x7fffffff ? static_cast<std::int32_t>(number) : -1);
            if (!element.isStrips()) {
                appendFace(corners, faces);
                continue;
            }
            const std::uint64_t before = faces.count;
            // Every second triangle is turned around; -1 begins a strip anew; what names a vertex twice joins strips.
            std::size_t begun = 0;
            for (std::size_t i = 0; i < corners.size(); ++i) {
                if (corners[i] == -1) begun = i + 1;
                if (i < begun + 2) continue;
                const std::int32_t a = corners[i - 2], b = corners[i - 1], c = corners[i];
                if (a == b || b == c || c == a) continue;
                (i - begun) % 2 == 0 ? appendFace({a, b, c}, faces) : appendFace({b, a, c}, faces);
            }
            if (faces.count == before && faces.emptyStrips++ == 0) faces.firstEmpty = faces.strips;
            ++faces.strips;
        }
    }
    return faces;
}

std::size_t PlyFile::readList(const PlyElement& element, std::size_t property, std::size_t at,
                              std::vector<double>& numbers) const {
    numbers.clear();
    if (encoding_ == Encoding::kText) {
        const std::size_t end = std::min(bytes_.find('\n', at), element.end);
        std::vector<std::string_view> words;
        (void)TextLines(bytes_.substr(at, end - at)).next(words);
        std::size_t word = 0;
        for (std::size_t p = 0; p <= property; ++p) {
            double length = 0;
            if (element.properties[p].isList) (void)isReal(words[word], length);
            for (std::size_t i = 0; p == property && i < static_cast<std::size_t>(length); ++i)
                (void)isReal(words[word + 1 + i], numbers.emplace_back());
            word += 1 + static_cast<std::size_t>(length);
        }
        return std::min(end + 1, element.end);
    }
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& each = element.properties[p];
        std::uint64_t many = 1;
        if (each.isList) {
            many = lengthAt(at, each.length);
            at += each.length.bytes;
        }
        for (std::uint64_t i = 0; p == property && i < many; ++i)
            numbers.push_back(numberAt(at + i * each.number.bytes, each.number));
        at += many * each.number.bytes;
    }
    return at;
}

void PlyFile::appendFace(const std::vector<std::int32_t>& corners, Faces& faces) const {
    ++faces.count;
    if (encoding_ == Encoding::kText) {
        faces.rows += std::to_string(corners.size());
        for (const std::int32_t corner : corners) faces.rows.append(1, ' ').append(std::to_string(corner));
        faces.rows.push_back('\n');
        return;
    }
    const auto append = [&](std::uint32_t number) {
        for (int i = 0; i < 4; ++i)
            faces.rows.push_back(static_cast<char>(number >> 8 * (encoding_ == Encoding::kBigEndian ? 3 - i : i)));
    };
    append(static_cast<std::uint32_t>(corners.size()));
    for (const std::int32_t corner : corners) append(static_cast<std::uint32_t>(corner));
}

}  // namespace tessera
