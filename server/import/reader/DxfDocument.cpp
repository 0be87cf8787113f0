#include "server/import/reader/DxfDocument.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

namespace tessera {
namespace {

/// Longer names are no names.
constexpr std::size_t kMostName = 255;

void appendUtf8(std::string& out, std::uint32_t code) {
    if (code < 0x80) {
        out.push_back(static_cast<char>(code));
    } else if (code < 0x800) {
        out.push_back(static_cast<char>(0xc0 | (code >> 6)));
        out.push_back(static_cast<char>(0x80 | (code & 63)));
    } else {
        out.push_back(static_cast<char>(0xe0 | (code >> 12)));
        out.push_back(static_cast<char>(0x80 | ((code >> 6) & 63)));
        out.push_back(static_cast<char>(0x80 | (code & 63)));
    }
}

/// Windows code page 1252, 0x80 to 0x9f; the rest is as Unicode has it.
constexpr std::array<std::uint16_t, 32> kWesternMarks = {0x20ac, '_',    0x201a, 0x192,  0x201e, 0x2026, 0x2020, 0x2021,
                                                         0x2c6,  0x2030, 0x160,  0x2039, 0x152,  '_',    0x17d,  '_',
                                                         '_',    0x2018, 0x2019, 0x201c, 0x201d, 0x2022, 0x2013, 0x2014,
                                                         0x2dc,  0x2122, 0x161,  0x203a, 0x153,  '_',    0x17e,  0x178};

std::uint32_t western(unsigned char byte) {
    return byte < 0xa0 ? kWesternMarks[byte - 0x80] : byte;
}

/// Code page 1251: Russian letters; of the others those that Russian text has.
std::uint32_t cyrillic(unsigned char byte) {
    if (byte >= 0xc0) return 0x410U + byte - 0xc0U;
    switch (byte) {
        case 0xa8:
            return 0x401;
        case 0xb8:
            return 0x451;
        case 0xb9:
            return 0x2116;
        case 0xab:
        case 0xbb:
        case 0xb0:
            return byte;
        default:
            return '_';
    }
}

/// Code pages of DOS, 0x80 to 0xff: 437 of the United States, 850 of Western Europe.
constexpr std::u16string_view kDos437 =
    u"ÇüéâäàåçêëèïîìÄÅÉæÆôöòûùÿÖÜ¢£¥₧ƒáíóúñÑªº¿⌐¬½¼¡«»░▒▓│┤╡╢╖╕╣║╗╝╜╛┐"
    u"└┴┬├─┼╞╟╚╔╩╦╠═╬╧╨╤╥╙╘╒╓╫╪┘┌█▄▌▐▀αßΓπΣσµτΦΘΩδ∞φε∩≡±≥≤⌠⌡÷≈°∙·√ⁿ²■\u00a0";
constexpr std::u16string_view kDos850 =
    u"ÇüéâäàåçêëèïîìÄÅÉæÆôöòûùÿÖÜø£Ø×ƒáíóúñÑªº¿®¬½¼¡«»░▒▓│┤ÁÂÀ©╣║╗╝¢¥┐"
    u"└┴┬├─┼ãÃ╚╔╩╦╠═╬¤ðÐÊËÈıÍÎÏ┘┌█▄¦Ì▀ÓßÔÒõÕµþÞÚÛÙýÝ¯´\u00ad±‗¾¶§÷¸°¨·¹³²■\u00a0";
static_assert(kDos437.size() == 128 && kDos850.size() == 128);

/// Bytes of a sound character of UTF-8, of up to three bytes or four; 0: none begins here.
std::size_t utf8Length(std::string_view text) {
    const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
    const auto follows = [&](std::size_t i) { return (byte(i) & 0xc0) == 0x80; };
    if (byte(0) >= 0xc2 && byte(0) < 0xe0 && follows(1)) return 2;
    if (byte(0) >= 0xe0 && byte(0) < 0xf0 && follows(1) && follows(2)) {
        const unsigned code = ((byte(0) & 15) << 12) | ((byte(1) & 63) << 6) | (byte(2) & 63);
        return code >= 0x800 && (code < 0xd800 || code > 0xdfff) ? 3 : 0;
    }
    if (byte(0) >= 0xf0 && byte(0) < 0xf5 && follows(1) && follows(2) && follows(3)) {
        const unsigned code = ((byte(0) & 7) << 18) | ((byte(1) & 63) << 12);
        return code >= 0x10000 && code <= 0x10ffff ? 4 : 0;
    }
    return 0;
}

}  // namespace

std::string dxfKey(std::string_view name) {
    std::string key(name.substr(0, kMostName));
    for (char& c : key)
        if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    return key;
}

Expected<DxfDocument> DxfDocument::open(std::string_view bytes) {
    Expected<DxfGroups> groups = DxfGroups::of(bytes);
    if (!groups) return tl::unexpected(groups.error());
    return DxfDocument(std::move(*groups));
}

Expected<bool> DxfDocument::toEntities() {
    std::string section;
    for (DxfRecord record; groups_.next(record);) {
        if (record.type == "SECTION") {
            section = dxfKey(record.word(2));
            if (section == "ENTITIES") return true;
            if (section == "HEADER") readHeader(record);
        } else if (record.type == "ENDSEC") {
            section.clear();
        } else if (section == "TABLES" && record.type == "LAYER") {
            readLayer(record);
        } else if (section == "BLOCKS" && record.type == "BLOCK") {
            constexpr std::int64_t kExternal = 4 | 8 | 32;
            blocks_.try_emplace(dxfKey(record.word(2)), DxfBlock{.name = text(record.word(2).substr(0, kMostName)),
                                                                 .base = record.point(10),
                                                                 .external = (record.integer(70, 0) & kExternal) != 0,
                                                                 .content = groups_.mark()});
        }
    }
    if (!groups_.fault().empty()) return fail(ErrorCode::kBadInput, groups_.fault());
    if (!groups_.ended()) cut_ = fmt::format("it ends without 'EOF' ({}): it is cut off", groups_.place());
    return false;
}

/// Variables are a name each (code 9) and values up to the next one. A header comes first.
void DxfDocument::readHeader(const DxfRecord& section) {
    std::string_view variable;
    bool unicode = false;
    for (const DxfGroup& group : section.groups) {
        if (group.code == 9) variable = group.text;
        const auto is = [&](std::string_view name, int code) {
            return group.code == code && variable.substr(0, name.size()) == name;
        };
        if (is("$INSUNITS", 70)) units_ = static_cast<int>(group.integer() & 255);
        if (is("$ACADVER", 1)) unicode = dxfKey(group.text) >= "AC1021";
        if (is("$DWGCODEPAGE", 3)) {
            const std::string page = dxfKey(group.text.substr(0, group.text.find_last_not_of(" \r\t") + 1));
            static constexpr std::pair<std::string_view, Letters> kPages[] = {{"ANSI_1252", Letters::kWestern},
                                                                              {"ANSI_1251", Letters::kCyrillic},
                                                                              {"DOS437", Letters::kDos437},
                                                                              {"DOS850", Letters::kDos850}};
            const auto* const known = std::ranges::find(kPages, page, &std::pair<std::string_view, Letters>::first);
            letters_ = known != std::end(kPages) ? known->second : Letters::kAscii;
            strange_ = letters_ == Letters::kAscii ? page : "";
        }
    }
    if (!unicode) return;
    letters_ = Letters::kUtf8;
    strange_.clear();
}

void DxfDocument::readLayer(const DxfRecord& record) {
    const std::string_view name = record.word(2);
    DxfLayer layer{.name = text(name.substr(0, kMostName)), .color = DxfColor::of(record, {7})};
    if (layer.color.value == DxfColor::kByBlock || layer.color.value == DxfColor::kByLayer) layer.color = {7};
    layer.hidden = record.integer(62, 7) < 0 || (record.integer(70, 0) & 1) != 0;
    // Where dimensions keep the points that they measure: it is never printed.
    layer.hidden |= dxfKey(name) == "DEFPOINTS";
    layers_.try_emplace(dxfKey(name), std::move(layer));
}

const DxfLayer& DxfDocument::layer(std::string_view name) {
    const std::string key = dxfKey(name.empty() ? "0" : name);
    const auto found = layers_.find(key);
    if (found != layers_.end()) return found->second;
    return layers_.emplace(key, DxfLayer{.name = text(name.empty() ? "0" : name.substr(0, kMostName))}).first->second;
}

const DxfBlock* DxfDocument::block(std::string_view name) const {
    const auto found = blocks_.find(dxfKey(name));
    return found == blocks_.end() ? nullptr : &found->second;
}

std::string DxfDocument::text(std::string_view value) const {
    std::string out;
    for (std::size_t i = 0; i < value.size(); ++i) {
        const auto byte = static_cast<unsigned char>(value[i]);
        std::uint32_t code = 0;
        if (const std::string_view rest = value.substr(i); rest.starts_with("\\U+") && rest.size() >= 7) {
            const auto [end, error] = std::from_chars(rest.data() + 3, rest.data() + 7, code, 16);
            if (error == std::errc() && end == rest.data() + 7 && code >= 0x20 && (code < 0xd800 || code > 0xdfff)) {
                appendUtf8(out, code);
                i += 6;
                continue;
            }
        }
        if (byte < 0x80) {
            out.push_back(byte >= 0x20 || byte == '\t' ? static_cast<char>(byte) : ' ');
            continue;
        }
        switch (letters_) {
            case Letters::kUtf8: {
                const std::size_t length = utf8Length(value.substr(i));
                out += length > 0 ? value.substr(i, length) : "_";
                i += std::max<std::size_t>(length, 1) - 1;
                break;
            }
            case Letters::kWestern:
                appendUtf8(out, western(byte));
                break;
            case Letters::kCyrillic:
                appendUtf8(out, cyrillic(byte));
                break;
            case Letters::kDos437:
                appendUtf8(out, kDos437[byte - 0x80U]);
                break;
            case Letters::kDos850:
                appendUtf8(out, kDos850[byte - 0x80U]);
                break;
            case Letters::kAscii:
                out.push_back('_');
                break;
        }
    }
    return out;
}

}  // namespace tessera
