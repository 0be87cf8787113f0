#include "client/testpicture/StrokeFont.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

/// Polylines of points on a grid of 5 × 7: two digits a point, x and y, the upper left is 00.
struct Letter {
    char character;
    std::string_view lines;
};
constexpr Letter kLetters[] = {
    {'A', "0602204246 0444"},
    {'B', "06003041423303 3344453606"},
    {'C', "4130100105163645"},
    {'D', "06003041453606"},
    {'E', "40000646 0333"},
    {'F', "400006 0333"},
    {'G', "41301001051636454323"},
    {'H', "0006 4046 0343"},
    {'I', "1030 2026 1636"},
    {'J', "4045361605"},
    {'K', "0006 400346"},
    {'L', "000646"},
    {'M', "0600234046"},
    {'N', "06004640"},
    {'O', "103041453616050110"},
    {'P', "06003041423303"},
    {'Q', "103041453616050110 2446"},
    {'R', "06003041423303 2346"},
    {'S', "413010010213334445361605"},
    {'T', "0040 2026"},
    {'U', "000516364540"},
    {'V', "002640"},
    {'W', "0016233640"},
    {'X', "0046 4006"},
    {'Y', "002340 2326"},
    {'Z', "00400646"},
    {'0', "103041453616050110 0541"},
    {'1', "112026 1636"},
    {'2', "01103041420646"},
    {'3', "004023334445361605"},
    {'4', "36300444"},
    {'5', "400002324345361605"},
    {'6', "3010010516364544331304"},
    {'7', "004016"},
    {'8', "1302011030414233130405163645443313"},
    {'9', "1636454130100102133342"},
    {'-', "1333"},
    {'+', "0343 2125"},
    {'_', "0646"},
    {'.', "2626"},
    {',', "2617"},
    {':', "2222 2525"},
    {'/', "0640"},
    {'(', "30212536"},
    {')', "10212516"},
    {'=', "0242 0444"},
    {'%', "0640 0011 3546"},
    {'\'', "2022"},
    {' ', ""},
};
constexpr std::string_view kUnknown = "0040460600";
constexpr double kUnit = 1.0 / 6, kGap = 2.0 / 6, kSmall = 0.75;

/// A letter's lines and how large it is beside a capital.
struct Shape {
    std::string_view lines = kUnknown;
    double scale = 1;
};
Shape shapeOf(char c) {
    const bool small = c >= 'a' && c <= 'z';
    const char capital = small ? static_cast<char>(c - 'a' + 'A') : c;
    const auto* found = std::find_if(std::begin(kLetters), std::end(kLetters),
                                     [&](const Letter& letter) { return letter.character == capital; });
    if (found == std::end(kLetters)) return {};
    return {found->lines, small ? kSmall : 1};
}
double advanceOf(const Shape& shape) {
    return shape.scale * (4 * kUnit + kGap);
}

}  // namespace

std::vector<Stroke> strokesOf(std::string_view text) {
    std::vector<Stroke> strokes;
    double left = 0;
    for (const char c : text) {
        const Shape shape = shapeOf(c);
        const double top = 1 - shape.scale;
        const auto x = [&](char digit) { return left + shape.scale * kUnit * (digit - '0'); };
        const auto y = [&](char digit) { return top + shape.scale * kUnit * (digit - '0'); };
        const std::string_view& lines = shape.lines;
        for (std::size_t i = 0; i + 3 < lines.size();) {
            if (lines[i + 2] == ' ') {
                i += 3;
                continue;
            }
            strokes.push_back({x(lines[i]), y(lines[i + 1]), x(lines[i + 2]), y(lines[i + 3])});
            i += 2;
        }
        left += advanceOf(shape);
    }
    return strokes;
}

double widthOfText(std::string_view text) {
    double width = 0;
    for (const char c : text) width += advanceOf(shapeOf(c));
    return text.empty() ? 0 : width - kGap * shapeOf(text.back()).scale;
}

}  // namespace tessera
