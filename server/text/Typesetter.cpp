#include "server/text/Typesetter.h"

#include <fmt/format.h>
#include <fontconfig/fontconfig.h>
#include <ft2build.h>
#include <hb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "server/text/TextRuns.h"

#include FT_FREETYPE_H
#include FT_OUTLINE_H

namespace tessera {
namespace {

template <typename T, void (*kFree)(T*)>
struct FreeBy {
    void operator()(T* object) const { kFree(object); }
};
using PatternPtr = std::unique_ptr<FcPattern, FreeBy<FcPattern, FcPatternDestroy>>;
using BufferPtr = std::unique_ptr<hb_buffer_t, FreeBy<hb_buffer_t, hb_buffer_destroy>>;

/// Opened fonts; beyond that they are forgotten and opened again.
constexpr std::size_t kMostFonts = 32;

std::string familyOf(FcPattern* pattern) {
    FcChar8* family = nullptr;
    return FcPatternGetString(pattern, FC_FAMILY, 0, &family) == FcResultMatch ? reinterpret_cast<const char*>(family)
                                                                               : "";
}

/// What fontconfig has a font for whatever is installed.
bool isGeneric(const std::string& family) {
    static const std::set<std::string> generic{"sans",      "sans-serif", "serif",   "monospace", "mono",
                                               "system-ui", "cursive",    "fantasy", ""};
    return generic.contains(family);
}

bool hasFamily(FcPattern* found, const std::string& family) {
    FcChar8* name = nullptr;
    for (int i = 0; FcPatternGetString(found, FC_FAMILY, i, &name) == FcResultMatch; ++i)
        if (FcStrCmpIgnoreCase(name, reinterpret_cast<const FcChar8*>(family.c_str())) == 0) return true;
    return false;
}

struct FoundFont {
    std::string file, family;
    int face = 0;
};

Expected<FoundFont> findInstalled(const std::string& name, std::vector<std::string>& notes) {
    const std::string asked = name.empty() ? "sans" : name;
    const PatternPtr pattern(FcNameParse(reinterpret_cast<const FcChar8*>(asked.c_str())));
    if (!pattern)
        return fail(
            ErrorCode::kBadInput,
            fmt::format("'{}' is no name of a font: write a family, or a family and a style as in serif:bold", asked));
    const std::string family = familyOf(pattern.get());
    // A name may not lead to a file; letters are outlines.
    FcPatternDel(pattern.get(), FC_FILE);
    FcPatternDel(pattern.get(), FC_OUTLINE);
    FcPatternAddBool(pattern.get(), FC_OUTLINE, FcTrue);
    FcConfigSubstitute(nullptr, pattern.get(), FcMatchPattern);
    FcDefaultSubstitute(pattern.get());
    FcResult result = FcResultNoMatch;
    const PatternPtr found(FcFontMatch(nullptr, pattern.get(), &result));
    FcChar8* file = nullptr;
    if (!found || FcPatternGetString(found.get(), FC_FILE, 0, &file) != FcResultMatch)
        return fail(ErrorCode::kUnsupported, "this machine has no font installed: letters cannot be set");
    FoundFont font{.file = reinterpret_cast<const char*>(file), .family = familyOf(found.get())};
    FcPatternGetInteger(found.get(), FC_INDEX, 0, &font.face);
    font.face &= 0xFFFF;  // above are variations
    if (!isGeneric(family) && !hasFamily(found.get(), family))
        notes.push_back(fmt::format("the font '{}' is not installed: set in {}", family, font.family));
    return font;
}

/// FreeType's outline as contours of 1/65536 em.
struct OutlineReader {
    LetterShape shape;
    double perUnit = 1;

    [[nodiscard]] OutlinePoint point(const FT_Vector* v) const {
        return {static_cast<std::int32_t>(std::lround(perUnit * static_cast<double>(v->x))),
                static_cast<std::int32_t>(std::lround(perUnit * static_cast<double>(v->y)))};
    }
    int add(std::uint32_t degree, std::initializer_list<const FT_Vector*> points) {
        if (shape.empty()) return 1;
        OutlineSegment segment{.degree = degree, .points = {}};
        std::ranges::transform(points, segment.points.begin(), [&](const FT_Vector* v) { return point(v); });
        shape.back().segments.push_back(segment);
        return 0;
    }
    static OutlineReader& of(void* user) { return *static_cast<OutlineReader*>(user); }
};

constexpr FT_Outline_Funcs kReadOutline{
    .move_to =
        [](const FT_Vector* to, void* user) {
            OutlineReader::of(user).shape.push_back({.start = OutlineReader::of(user).point(to), .segments = {}});
            return 0;
        },
    .line_to = [](const FT_Vector* to, void* user) { return OutlineReader::of(user).add(1, {to}); },
    .conic_to =
        [](const FT_Vector* control, const FT_Vector* to, void* user) {
            return OutlineReader::of(user).add(2, {control, to});
        },
    .cubic_to =
        [](const FT_Vector* first, const FT_Vector* second, const FT_Vector* to, void* user) {
            return OutlineReader::of(user).add(3, {first, second, to});
        },
    .shift = 0,
    .delta = 0,
};

/// For a letter that a font has not, and has no picture for.
LetterShape box() {
    const auto around = [](std::int32_t x0, std::int32_t y0, std::int32_t x1, std::int32_t y1) {
        const auto line = [](std::int32_t x, std::int32_t y) {
            return OutlineSegment{.degree = 1, .points = {OutlinePoint{x, y}}};
        };
        return OutlineContour{.start = {x0, y0}, .segments = {line(x1, y0), line(x1, y1), line(x0, y1)}};
    };
    OutlineContour hole = around(7000, 3000, 33000, 45000);
    std::ranges::reverse(hole.segments);
    return {around(4000, 0, 36000, 48000), hole};
}

}  // namespace

struct Typesetter::Font {
    Font() = default;
    Font(const Font&) = delete;
    Font& operator=(const Font&) = delete;
    ~Font() {
        if (shaping) hb_font_destroy(shaping);
        if (face) FT_Done_Face(face);
    }
    [[nodiscard]] double perUnit() const { return OutlinePoint::kPerEm / static_cast<double>(face->units_per_EM); }
    [[nodiscard]] LetterShape shapeOf(hb_codepoint_t glyph) const {
        OutlineReader reader{.shape = {}, .perUnit = perUnit()};
        const bool read = FT_Load_Glyph(face, glyph, FT_LOAD_NO_SCALE | FT_LOAD_NO_BITMAP) == 0 &&
                          face->glyph->format == FT_GLYPH_FORMAT_OUTLINE &&
                          FT_Outline_Decompose(&face->glyph->outline, &kReadOutline, &reader) == 0;
        if (!read) reader.shape.clear();
        return glyph == 0 && reader.shape.empty() ? box() : std::move(reader.shape);
    }

    std::string family;
    std::vector<std::string> notes;  ///< for whoever asks for it by that name
    FT_Face face = nullptr;
    hb_font_t* shaping = nullptr;  ///< in the font's own units
};

struct Typesetter::Fonts {
    FT_Library library = nullptr;
    std::map<std::string, std::unique_ptr<Font>> byName;
    ~Fonts() {
        byName.clear();
        if (library) FT_Done_FreeType(library);
    }
};

Typesetter::Typesetter() : fonts_(std::make_unique<Fonts>()) {}
Typesetter::~Typesetter() = default;
Typesetter::Typesetter(Typesetter&&) noexcept = default;

Expected<Typesetter::Font*> Typesetter::find(const std::string& name, std::vector<std::string>& notes) {
    if (name.size() > kMostFontBytes)
        return fail(ErrorCode::kLimit,
                    fmt::format("the font's name has {} bytes, at most {} are allowed", name.size(), kMostFontBytes));
    if (const auto known = fonts_->byName.find(name); known != fonts_->byName.end()) {
        notes.insert(notes.end(), known->second->notes.begin(), known->second->notes.end());
        return known->second.get();
    }
    auto font = std::make_unique<Font>();
    const Expected<FoundFont> found = findInstalled(name, font->notes);
    if (!found) return tl::unexpected(found.error());
    if (!fonts_->library && FT_Init_FreeType(&fonts_->library) != 0)
        return fail(ErrorCode::kFailed, "FreeType does not start");
    const Error broken{ErrorCode::kUnsupported, fmt::format("the font {} cannot be read", found->family)};
    if (FT_New_Face(fonts_->library, found->file.c_str(), found->face, &font->face) != 0 ||
        font->face->units_per_EM == 0)
        return tl::unexpected(broken);
    hb_blob_t* bytes = hb_blob_create_from_file(found->file.c_str());
    hb_face_t* face = hb_face_create(bytes, static_cast<unsigned>(found->face));
    hb_blob_destroy(bytes);
    font->shaping = hb_font_create(face);
    hb_face_destroy(face);
    hb_font_set_scale(font->shaping, font->face->units_per_EM, font->face->units_per_EM);
    font->family = found->family;
    notes.insert(notes.end(), font->notes.begin(), font->notes.end());
    if (fonts_->byName.size() >= kMostFonts) fonts_->byName.clear();
    return (fonts_->byName[name] = std::move(font)).get();
}

/// One text on its way: shapes that have come, the pen.
struct Typesetter::Setting {
    const Font& font;
    TextOutlines made;
    std::map<hb_codepoint_t, std::optional<std::uint32_t>> shapes;  ///< by glyph; nothing for blanks
    std::size_t missing = 0;

    /// In the font's units, from the pen on; moves the pen.
    void add(std::u32string_view line, const TextRun& run, double& pen, double baseline) {
        const BufferPtr buffer(hb_buffer_create());
        // All of the line: letters are joined by what is beside them.
        hb_buffer_add_utf32(buffer.get(), reinterpret_cast<const std::uint32_t*>(line.data()),
                            static_cast<int>(line.size()), static_cast<unsigned>(run.begin),
                            static_cast<int>(run.length));
        hb_buffer_set_direction(buffer.get(), run.rightToLeft ? HB_DIRECTION_RTL : HB_DIRECTION_LTR);
        if (const auto script = static_cast<hb_script_t>(run.script); script != HB_SCRIPT_COMMON)
            hb_buffer_set_script(buffer.get(), script);
        hb_buffer_set_language(buffer.get(), hb_language_from_string("en", -1));  // the same wherever it runs
        hb_buffer_guess_segment_properties(buffer.get());
        hb_shape(font.shaping, buffer.get(), nullptr, 0);
        unsigned many = 0;
        const hb_glyph_info_t* glyphs = hb_buffer_get_glyph_infos(buffer.get(), &many);
        const hb_glyph_position_t* places = hb_buffer_get_glyph_positions(buffer.get(), &many);
        for (unsigned i = 0; i < many; ++i) {
            missing += glyphs[i].codepoint == 0 ? 1 : 0;
            if (const std::optional<std::uint32_t> shape = shapeOf(glyphs[i].codepoint)) {
                const auto unit = [&](double v) { return static_cast<std::int32_t>(std::lround(font.perUnit() * v)); };
                made.letters.push_back(
                    {.shape = *shape,
                     .at = {unit(pen + places[i].x_offset),
                            static_cast<std::int32_t>(std::lround(baseline)) + unit(places[i].y_offset)}});
            }
            pen += places[i].x_advance;
        }
    }
    std::optional<std::uint32_t> shapeOf(hb_codepoint_t glyph) {
        const auto [entry, isNew] = shapes.try_emplace(glyph);
        if (!isNew) return entry->second;
        LetterShape shape = font.shapeOf(glyph);
        if (shape.empty()) return std::nullopt;
        entry->second = static_cast<std::uint32_t>(made.shapes.size());
        made.shapes.push_back(std::move(shape));
        return entry->second;
    }
};

Expected<TextOutlines> Typesetter::set(const Text& text, std::vector<std::string>& notes) {
    if (text.text.size() > kMostTextBytes)
        return fail(ErrorCode::kLimit,
                    fmt::format("the text has {} bytes, at most {} are allowed", text.text.size(), kMostTextBytes));
    const Expected<std::vector<std::u32string>> lines = linesOf(text.text);
    if (!lines) return tl::unexpected(lines.error());
    if (std::ranges::all_of(*lines, [](const std::u32string& line) { return line.empty(); })) return TextOutlines();
    const Expected<Font*> font = find(text.font, notes);
    if (!font) return tl::unexpected(font.error());
    constexpr double kFarthest = OutlinePoint::kFarthest / 2.0;  // what hangs over, and marks, have the other half
    if (!(std::abs(text.lineSpacing) * static_cast<double>(lines->size() - 1) * OutlinePoint::kPerEm <= kFarthest))
        return fail(ErrorCode::kLimit, "the lines of the text are farther apart than 2048 em");
    Setting setting{.font = **font, .made = {}, .shapes = {}};
    for (std::size_t i = 0; i < lines->size(); ++i) {
        const std::size_t first = setting.made.letters.size();
        const double baseline = -text.lineSpacing * static_cast<double>(i) * OutlinePoint::kPerEm;
        double pen = 0;
        for (const TextRun& run : runsOf((*lines)[i])) {
            setting.add((*lines)[i], run, pen, baseline);
            if (pen * (*font)->perUnit() > kFarthest)
                return fail(ErrorCode::kLimit, fmt::format("line {} of the text is longer than 2048 em", i + 1));
        }
        const double share = text.alignment == Text::kCenter ? 0.5 : text.alignment == Text::kRight ? 1 : 0;
        const auto back = static_cast<std::int32_t>(std::lround(share * pen * (*font)->perUnit()));
        for (std::size_t l = first; l < setting.made.letters.size(); ++l) setting.made.letters[l].at.x -= back;
    }
    if (setting.missing > 0)
        notes.push_back(fmt::format("{} of the letters {} not in {}: shown as boxes", setting.missing,
                                    setting.missing == 1 ? "is" : "are", (*font)->family));
    return std::move(setting.made);
}

}  // namespace tessera
