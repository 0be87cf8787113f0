#include "server/import/reader/DxfGroups.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

namespace tessera {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kSentinel = "AutoCAD Binary DXF\r\n\x1a\0"sv;
/// Beyond, an entity is no entity that anybody draws.
constexpr std::size_t kMostGroups = 8'000'000;
constexpr int kEmbedded = 101, kApplication = 102, kExtended = 1000;

std::string_view trimmed(std::string_view text) {
    const auto isSpace = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
    while (!text.empty() && isSpace(text.front())) text.remove_prefix(1);
    while (!text.empty() && isSpace(text.back())) text.remove_suffix(1);
    return text;
}

enum class Kind { kText, kDouble, kInt16, kInt32, kInt64, kBool, kChunk, kUnknown };

/// AutoCAD's DXF Reference, "Group Code Value Types".
Kind kindOf(int code) {
    struct Range {
        int first, last;
        Kind kind;
    };
    static constexpr Range kRanges[] = {
        {0, 9, Kind::kText},        {10, 59, Kind::kDouble},    {60, 79, Kind::kInt16},    {90, 99, Kind::kInt32},
        {100, 102, Kind::kText},    {105, 105, Kind::kText},    {110, 149, Kind::kDouble}, {160, 169, Kind::kInt64},
        {170, 179, Kind::kInt16},   {210, 239, Kind::kDouble},  {270, 289, Kind::kInt16},  {290, 299, Kind::kBool},
        {300, 309, Kind::kText},    {310, 319, Kind::kChunk},   {320, 369, Kind::kText},   {370, 389, Kind::kInt16},
        {390, 399, Kind::kText},    {400, 409, Kind::kInt16},   {410, 419, Kind::kText},   {420, 429, Kind::kInt32},
        {430, 439, Kind::kText},    {440, 459, Kind::kInt32},   {460, 469, Kind::kDouble}, {470, 481, Kind::kText},
        {999, 1003, Kind::kText},   {1004, 1004, Kind::kChunk}, {1005, 1009, Kind::kText}, {1010, 1059, Kind::kDouble},
        {1060, 1070, Kind::kInt16}, {1071, 1071, Kind::kInt32},
    };
    for (const Range& range : kRanges)
        if (code >= range.first && code <= range.last) return range.kind;
    return Kind::kUnknown;
}

}  // namespace

double DxfGroup::number() const {
    if (binary) return *binary;
    std::string_view said = trimmed(text);
    if (said.starts_with('+')) said.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(said.data(), said.data() + said.size(), value);
    return error == std::errc() && end != said.data() ? value : std::numeric_limits<double>::quiet_NaN();
}

std::int64_t DxfGroup::integer() const {
    const double value = number();
    return std::abs(value) < 9e15 ? static_cast<std::int64_t>(value) : 0;
}

const DxfGroup* DxfRecord::find(int code) const {
    const auto found = std::ranges::find(groups, code, &DxfGroup::code);
    return found == groups.end() ? nullptr : &*found;
}

double DxfRecord::number(int code, double otherwise) const {
    const DxfGroup* group = find(code);
    return group ? group->number() : otherwise;
}

std::int64_t DxfRecord::integer(int code, std::int64_t otherwise) const {
    const DxfGroup* group = find(code);
    return group ? group->integer() : otherwise;
}

std::string_view DxfRecord::word(int code) const {
    const DxfGroup* group = find(code);
    return group ? trimmed(group->text) : std::string_view();
}

Vec3d DxfRecord::point(int code, const Vec3d& otherwise) const {
    return {number(code, otherwise.x()), number(code + 10, otherwise.y()), number(code + 20, otherwise.z())};
}

std::vector<Vec3d> DxfRecord::points(int code, double z) const {
    std::vector<Vec3d> all;
    for (const DxfGroup& group : groups) {
        if (group.code == code) all.emplace_back(group.number(), 0, z);
        if (all.empty()) continue;
        if (group.code == code + 10) all.back().y() = group.number();
        if (group.code == code + 20) all.back().z() = group.number();
    }
    return all;
}

std::vector<double> DxfRecord::numbers(int code) const {
    std::vector<double> all;
    for (const DxfGroup& group : groups)
        if (group.code == code) all.push_back(group.number());
    return all;
}

Expected<DxfGroups> DxfGroups::of(std::string_view bytes) {
    const bool binary = bytes.starts_with(kSentinel);
    std::size_t at = 0;
    if (binary)
        at = kSentinel.size();
    else if (bytes.starts_with("\xef\xbb\xbf"))
        at = 3;
    // Before release 13 a code was a byte, and the first group is 0 and "SECTION".
    const bool shortCodes = binary && bytes.size() > at + 1 && bytes[at + 1] != '\0';
    const bool oldMac = !binary && bytes.find('\n') == bytes.npos;
    DxfGroups groups(bytes, at, binary, shortCodes, oldMac ? '\r' : '\n');
    do {
        if (!groups.readGroup(groups.head_))
            return fail(ErrorCode::kBadInput,
                        groups.fault_.empty() ? "it is no DXF: it has no groups" : "it is no DXF: " + groups.fault_);
    } while (groups.head_.code == 999);
    if (groups.head_.code != 0) return fail(ErrorCode::kBadInput, "it is no DXF: it does not begin with a section");
    return groups;
}

void DxfGroups::goTo(const Mark& mark) {
    at_ = mark.at;
    line_ = mark.line;
    head_ = mark.head;
    ended_ = false;
    fault_.clear();
}

std::string DxfGroups::place() const {
    return binary_ ? fmt::format("byte {}", at_) : fmt::format("line {}", line_);
}

bool DxfGroups::failHere(const std::string& what) {
    fault_ = fmt::format("{}: {}", place(), what);
    return false;
}

bool DxfGroups::next(DxfRecord& record) {
    record.groups.clear();
    record.type = trimmed(head_.text);
    if (record.type == "EOF") {
        ended_ = true;
        return false;
    }
    bool inApplication = false, embedded = false;
    for (DxfGroup group; readGroup(group);) {
        if (group.code == 0) {
            head_ = group;
            return true;
        }
        embedded |= group.code == kEmbedded;
        if (group.code == kApplication) inApplication = group.text.find('{') != group.text.npos;
        if (embedded || inApplication || group.code >= kExtended || group.code == 999) continue;
        if (record.groups.size() >= kMostGroups)
            return failHere(fmt::format("an entity has more than {} groups", kMostGroups));
        record.groups.push_back(group);
    }
    return false;
}

bool DxfGroups::readGroup(DxfGroup& group) {
    return binary_ ? readBinary(group) : readText(group);
}

bool DxfGroups::takeLine(std::string_view& line) {
    if (at_ >= bytes_.size()) return false;
    // Most are of few letters, and looked through faster than memchr begins.
    constexpr std::size_t kShort = 16;
    std::size_t end = at_;
    const std::size_t near = std::min(at_ + kShort, bytes_.size());
    while (end < near && bytes_[end] != lineEnd_) ++end;
    if (end == near) end = std::min(bytes_.find(lineEnd_, end), bytes_.size());
    line = bytes_.substr(at_, end - at_);
    if (line.ends_with('\r')) line.remove_suffix(1);
    at_ = end + 1;
    return true;
}

bool DxfGroups::readText(DxfGroup& group) {
    std::string_view code;
    if (!takeLine(code)) return false;
    code = trimmed(code);
    if (code.empty() && at_ >= bytes_.size()) return false;
    const auto [end, error] = std::from_chars(code.data(), code.data() + code.size(), group.code);
    if (error != std::errc() || end != code.data() + code.size() || code.empty())
        return failHere(fmt::format("a group's code is expected, not '{}'", code.substr(0, 40)));
    ++line_;
    if (!takeLine(group.text)) return false;
    ++line_;
    return true;
}

bool DxfGroups::readBinary(DxfGroup& group) {
    const std::size_t begin = at_;
    const auto take = [&](auto value) -> std::optional<decltype(value)> {
        if (sizeof(value) > bytes_.size() - at_) return std::nullopt;
        std::memcpy(&value, bytes_.data() + at_, sizeof(value));
        at_ += sizeof(value);
        return value;
    };
    static_assert(std::endian::native == std::endian::little);
    group.binary.reset();
    group.text = {};
    std::optional<std::uint16_t> code;
    if (shortCodes_) {
        const std::optional<std::uint8_t> byte = take(std::uint8_t{});
        if (byte && *byte < 255) code = *byte;
        if (byte && *byte == 255) code = take(std::uint16_t{});
    } else {
        code = take(std::uint16_t{});
    }
    if (!code) return false;
    group.code = *code;
    const auto number = [&](auto value) {
        const auto taken = take(value);
        if (taken) group.binary = static_cast<double>(*taken);
        return taken.has_value();
    };
    switch (kindOf(group.code)) {
        case Kind::kText: {
            const std::size_t end = bytes_.find('\0', at_);
            if (end == bytes_.npos) return false;
            group.text = bytes_.substr(at_, end - at_);
            at_ = end + 1;
            return true;
        }
        case Kind::kDouble:
            return number(double{});
        case Kind::kInt16:
            return number(std::int16_t{});
        case Kind::kInt32:
            return number(std::int32_t{});
        case Kind::kInt64:
            return number(std::int64_t{});
        case Kind::kBool:
            return number(std::uint8_t{});
        case Kind::kChunk: {
            const std::optional<std::uint8_t> size = take(std::uint8_t{});
            if (!size || *size > bytes_.size() - at_) return false;
            at_ += *size;
            return true;
        }
        case Kind::kUnknown:
            break;
    }
    at_ = begin;
    return failHere(fmt::format("group code {} has no type", group.code));
}

}  // namespace tessera
