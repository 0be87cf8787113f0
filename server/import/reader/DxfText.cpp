#include "server/import/reader/DxfText.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "server/import/reader/DxfCurves.h"

namespace tessera {
namespace {

using proto::scene::Text;

constexpr std::size_t kMostBytes = 16000;  ///< with signs for fonts and the like, as the file has it
/// DXF says how tall capitals are; a Text the em, of which they are so much in sans faces.
constexpr double kCapitals = 0.72;
/// From baseline to baseline of an MTEXT, in heights.
constexpr double kLineSpacing = 5.0 / 3;
/// Below the baseline, in heights.
constexpr double kDescent = 0.3;
/// An average letter's width, in heights.
constexpr double kLetterWidth = 0.75;

/// As a Text may have it, whole characters alone: its lines are at most 2048 em long, and so far apart together.
std::string bounded(const std::string& text, bool& isCut) {
    constexpr std::size_t kMostOfLine = 1000, kMostLines = 400;
    std::string out;
    std::size_t ofLine = 0, lines = 1;
    for (std::size_t at = 0, end = 0; at < text.size(); at = end) {
        end = at + 1;
        while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) ++end;
        const bool breaks = text[at] == '\n';
        if (out.size() + end - at > kMostDxfTextBytes || (breaks && ++lines > kMostLines)) {
            isCut = true;
            break;
        }
        ofLine = breaks ? 0 : ofLine + 1;
        if (ofLine <= kMostOfLine)
            out.append(text, at, end - at);
        else
            isCut = true;
    }
    return out;
}

bool isBlank(const std::string& text) {
    return text.find_first_not_of(" \t\n") == text.npos;
}

bool isSound(const Affine3d& place, double height) {
    return place.matrix().cwiseAbs().maxCoeff() < 1e12 && height > 1e-12 && height < 1e12;
}

Text::Alignment alignmentOf(std::int64_t column) {
    return column == 0 ? Text::LEFT : column == 1 ? Text::CENTER : Text::RIGHT;
}

std::size_t letters(std::string_view text) {
    return static_cast<std::size_t>(
        std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

std::string wrapped(const std::string& text, double most) {
    std::string out;
    std::size_t line = 0;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find_first_of(" \n", at), text.size());
        const std::size_t word = letters(std::string_view(text).substr(at, end - at));
        if (line > 0 && static_cast<double>(line + 1 + word) > most) {
            out.push_back('\n');
            line = 0;
        } else if (line > 0) {
            out.push_back(' ');
            ++line;
        }
        out.append(text, at, end - at);
        line += word;
        if (end < text.size() && text[end] == '\n') {
            out.push_back('\n');
            line = 0;
        }
        at = end + 1;
    }
    return out;
}

}  // namespace

std::string dxfPlainText(std::string_view text) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (!text.substr(i).starts_with("%%") || i + 2 >= text.size()) {
            out.push_back(text[i]);
            continue;
        }
        const char code = text[i + 2];
        i += 2;
        int number = 0;
        switch (code) {
            case 'd':
            case 'D':
                out += "°";
                break;
            case 'c':
            case 'C':
                out += "Ø";
                break;
            case 'p':
            case 'P':
                out += "±";
                break;
            case '%':
                out += "%";
                break;
            default:
                if (code >= '0' && code <= '9') {
                    const std::string_view digits = text.substr(i, 3);
                    const auto end = std::from_chars(digits.data(), digits.data() + digits.size(), number).ptr;
                    i += static_cast<std::size_t>(end - digits.data()) - 1;
                    if (number >= 0x20 && number < 0x7f) out.push_back(static_cast<char>(number));
                }
        }
    }
    return out;
}

std::string dxfParagraphs(std::string_view text) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '{' || c == '}') continue;
        if (c == '^' && i + 1 < text.size()) {
            const char control = text[++i];
            out += control == 'J' || control == 'M' ? "\n" : control == ' ' ? "^" : " ";
            continue;
        }
        if (c != '\\' || i + 1 >= text.size()) {
            out.push_back(c);
            continue;
        }
        const char code = text[++i];
        const std::size_t end = std::min(text.find(';', i), text.size());
        switch (code) {
            case 'P':
            case 'N':
            case 'X':
                out.push_back('\n');
                break;
            case '~':
                out.push_back(' ');
                break;
            case '\\':
            case '{':
            case '}':
                out.push_back(code);
                break;
            case 'S':
                for (const char part : text.substr(i + 1, end - i - 1))
                    if (part != ' ') out.push_back(part == '^' || part == '#' ? '/' : part);
                i = end;
                break;
            case 'A':
            case 'C':
            case 'c':
            case 'F':
            case 'f':
            case 'H':
            case 'p':
            case 'Q':
            case 'T':
            case 'W':
                i = end;
                break;
            default:
                break;  // lines above, below and through
        }
    }
    return dxfPlainText(out);
}

std::optional<DxfLetters> dxfLineOfText(const DxfRecord& record, const DxfDocument& document) {
    const DxfGroup* const value = record.find(1);
    DxfLetters made;
    if (value) {
        made.isCut = value->text.size() > kMostBytes;
        made.text.set_text(bounded(dxfPlainText(document.text(value->text.substr(0, kMostBytes))), made.isCut));
    }
    if (isBlank(made.text.text())) return std::nullopt;
    const double height = record.number(40, 1);
    const std::int64_t across = record.integer(72, 0), upright = record.integer(record.type == "TEXT" ? 73 : 74, 0);
    const Vec3d first = record.point(10), second = record.point(11, first);
    const bool between = upright == 0 && (across == 3 || across == 5);  // set between two points
    double turn = record.number(50, 0) * std::numbers::pi / 180;
    Vec3d at = (across == 0 && upright == 0) || !record.find(11) ? first : second;
    if (between) {
        at = 0.5 * (first + second);
        if ((second - first).head<2>().norm() > 0) turn = std::atan2(second.y() - first.y(), second.x() - first.x());
    }
    const double down = upright == 1 ? -kDescent : upright == 2 || across == 4 ? 0.5 : upright == 3 ? 1 : 0;
    made.text.set_alignment(across == 0 ? Text::LEFT : across == 2 ? Text::RIGHT : Text::CENTER);
    made.text.set_size(height / kCapitals);
    const double wide = record.number(41, 1);
    const std::int64_t mirrored = record.integer(71, 0);
    const Vec3d scale((wide > 0.01 && wide < 100 ? wide : 1) * ((mirrored & 2) != 0 ? -1 : 1),
                      (mirrored & 4) != 0 ? -1 : 1, 1);
    made.place = Affine3d(dxfFrame(record.point(210, Vec3d::UnitZ()))) * Eigen::Translation3d(at) *
                 Eigen::AngleAxisd(turn, Vec3d::UnitZ()) * Eigen::Translation3d(0, -down * height, 0) *
                 Eigen::Scaling(scale);
    made.sheared = std::abs(record.number(51, 0)) > 1e-6;
    if (!isSound(made.place, height)) return std::nullopt;
    return made;
}

std::optional<DxfLetters> dxfTextBlock(const DxfRecord& record, const DxfDocument& document) {
    std::string all;
    for (const DxfGroup& group : record.groups)
        if ((group.code == 3 || group.code == 1) && all.size() < kMostBytes) all += group.text;
    const double height = record.number(40, 1), width = record.number(41, 0);
    std::string text = dxfParagraphs(document.text(std::string_view(all).substr(0, kMostBytes)));
    if (width > height) text = wrapped(text, width / (height * kLetterWidth));
    DxfLetters made;
    made.isCut = all.size() > kMostBytes;
    made.text.set_text(bounded(text, made.isCut));
    if (isBlank(made.text.text())) return std::nullopt;
    const std::int64_t corner = std::clamp<std::int64_t>(record.integer(71, 1), 1, 9) - 1;
    double spacing = record.number(44, 1);
    if (!(spacing >= 0.25 && spacing <= 4)) spacing = 1;
    spacing *= kLineSpacing;
    const auto lines = static_cast<double>(std::ranges::count(made.text.text(), '\n'));
    const double tall = 1 + lines * spacing;
    const double down = corner < 3 ? 1 : corner < 6 ? 1 - tall / 2 : 1 - tall;
    made.text.set_alignment(alignmentOf(corner % 3));
    made.text.set_size(height / kCapitals);
    made.text.set_line_spacing(spacing * kCapitals);
    const Vec3d extrusion = record.point(210, Vec3d::UnitZ());
    const Mat3d frame = dxfFrame(extrusion);
    Vec3d along =
        frame * Eigen::AngleAxisd(record.number(50, 0) * std::numbers::pi / 180, Vec3d::UnitZ()) * Vec3d::UnitX();
    if (record.find(11)) along = record.point(11);  // in the world's coordinates, as its place is
    Mat3d turn;
    turn.col(2) = frame.col(2);
    turn.col(1) = turn.col(2).cross(along).normalized();
    turn.col(0) = turn.col(1).cross(turn.col(2));
    if (!(turn.col(1).norm() > 0.5)) turn = frame;
    made.place.linear() = turn;
    made.place.translation() = record.point(10) - turn.col(1) * (down * height);
    if (!isSound(made.place, height)) return std::nullopt;
    return made;
}

}  // namespace tessera
