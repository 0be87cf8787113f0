/// Letters of text: found among the fonts of this machine, placed, and handed on as outlines.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/cores/Text.h"
#include "common/geometry/TextOutlines.h"

namespace tessera {

/// fontconfig finds fonts, HarfBuzz shapes lines (kerning, ligatures, joined letters, right to left), FreeType reads
/// outlines. Only fonts that are installed are opened. Keeps fonts that it has opened; not thread-safe, several may
/// work beside each other.
class Typesetter {
public:
    static constexpr std::size_t kMostTextBytes = 16384, kMostFontBytes = 256;

    Typesetter();
    ~Typesetter();
    Typesetter(Typesetter&&) noexcept;
    Typesetter(const Typesetter&) = delete;
    Typesetter& operator=(const Typesetter&) = delete;

    /// Of text, font, lineSpacing and alignment. Lines end at '\n'; a tab is four spaces; other control characters are
    /// left out. What runs from right to left is placed so, in lines that begin with it and in others (TextRuns.h). A
    /// letter that the font has not is a box. `notes` is told what is not as asked for.
    ///
    /// Refused: what is no UTF-8, more than kMostTextBytes, a line longer or lines farther apart than 4096 em; where no
    /// font is installed.
    [[nodiscard]] Expected<TextOutlines> set(const Text& text, std::vector<std::string>& notes);

private:
    struct Font;
    struct Setting;
    [[nodiscard]] Expected<Font*> find(const std::string& name, std::vector<std::string>& notes);
    struct Fonts;
    std::unique_ptr<Fonts> fonts_;
};

}  // namespace tessera
