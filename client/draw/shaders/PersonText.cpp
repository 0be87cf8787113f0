#include "client/draw/shaders/PersonText.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>

namespace tessera {
namespace {

struct Token {
    std::string_view text;
    int line = 1;
    [[nodiscard]] bool is(std::string_view word) const { return text == word; }
    [[nodiscard]] bool isName() const { return std::isalpha(static_cast<unsigned char>(text[0])) || text[0] == '_'; }
};

/// What reaches beyond a function of numbers. Names that go on differently (image2D, imageLoad …) stand in
/// kRefusedBeginnings.
constexpr std::array kRefusedNames = std::to_array<std::string_view>({"main",
                                                                      "layout",
                                                                      "buffer",
                                                                      "shared",
                                                                      "coherent",
                                                                      "volatile",
                                                                      "restrict",
                                                                      "readonly",
                                                                      "writeonly",
                                                                      "varying",
                                                                      "attribute",
                                                                      "subroutine",
                                                                      "centroid",
                                                                      "sample",
                                                                      "patch",
                                                                      "flat",
                                                                      "smooth",
                                                                      "noperspective",
                                                                      "invariant",
                                                                      "precise",
                                                                      "barrier",
                                                                      "groupMemoryBarrier",
                                                                      "EmitVertex",
                                                                      "EndPrimitive",
                                                                      "EmitStreamVertex",
                                                                      "EndStreamPrimitive",
                                                                      "asm",
                                                                      "goto",
                                                                      "namespace",
                                                                      "using",
                                                                      "extern",
                                                                      "external",
                                                                      "interface",
                                                                      "ftransform"});
constexpr std::array kRefusedBeginnings =
    std::to_array<std::string_view>({"gl_", "tessera", "atomic", "image", "iimage", "uimage", "memoryBarrier",
                                     "interpolateAt", "subpass", "isampler", "usampler"});
constexpr std::array kUniformTypes = std::to_array<std::string_view>({"sampler2D", "float", "vec2", "vec3", "vec4"});

tl::unexpected<Error> failAt(std::string_view of, int line, std::string_view what) {
    return fail(ErrorCode::kBadInput, fmt::format("{}, line {}: {}", of, line, what));
}

/// Comments become blanks: what compilers differ about (other alphabets, lines that go on) is nothing then.
Expected<std::string> withoutComments(std::string_view text, std::string_view of) {
    std::string out(text);
    int line = 1;
    for (std::size_t i = 0; i < out.size(); ++i) {
        if (out.substr(i, 2) == "//") {
            while (i < out.size() && out[i] != '\n') out[i++] = ' ';
        } else if (out.substr(i, 2) == "/*") {
            const int begun = line;
            out[i] = out[i + 1] = ' ';
            for (i += 2; i < out.size() && out.compare(i, 2, "*/") != 0; ++i) {
                line += out[i] == '\n';
                if (out[i] != '\n') out[i] = ' ';
            }
            if (i >= out.size()) return failAt(of, begun, "a comment does not end");
            out[i] = out[i + 1] = ' ';
            ++i;
            continue;
        }
        if (i >= out.size()) break;
        const auto c = static_cast<unsigned char>(out[i]);
        if (c == '#') return failAt(of, line, "'#': there is no preprocessor here; a constant is said as const");
        if (c == '\r' || c == '\t') out[i] = ' ';
        const bool known =
            c == '\n' || c == '\r' || c == '\t' ||
            (c >= ' ' && c < 0x7f && std::string_view("\\$@\"'`").find(out[i]) == std::string_view::npos);
        if (!known)
            return failAt(of, line,
                          c < 0x20 || c > 0x7e ? fmt::format("a byte {:#04x}, which GLSL does not have", c)
                                               : fmt::format("'{}', which GLSL does not have", out[i]));
        line += c == '\n';
    }
    return out;
}

std::vector<Token> tokensOf(std::string_view text) {
    std::vector<Token> tokens;
    int line = 1;
    const auto inWord = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
    for (std::size_t i = 0; i < text.size();) {
        if (text[i] == '\n' || text[i] == ' ') {
            line += text[i++] == '\n';
            continue;
        }
        std::size_t end = i + 1;
        if (inWord(text[i])) {
            while (end < text.size() && inWord(text[end])) ++end;
        }
        tokens.push_back({text.substr(i, end - i), line});
        i = end;
    }
    return tokens;
}

/// One text on its way: its tokens, and what is put before some of them.
class Reader {
public:
    Reader(std::string_view of, std::string_view text) : of_(of), text_(text), tokens_(tokensOf(text)) {}

    Expected<void> check() {
        std::string open;
        for (std::size_t i = 0; i < tokens_.size(); ++i) {
            const Token& token = tokens_[i];
            if (token.isName())
                if (auto good = checkName(i, open.empty()); !good) return good;
            const char c = token.text[0];
            if (std::isdigit(static_cast<unsigned char>(c)) && token.text.find('_') != std::string_view::npos)
                return fail(i, fmt::format("'{}' is no number", token.text));
            if (c == '(' || c == '[' || c == '{') open.push_back(c == '(' ? ')' : c == '[' ? ']' : '}');
            if (open.size() > kMostPersonDepth)
                return fail(i, fmt::format("more than {} brackets in one another", kMostPersonDepth));
            if (c != ')' && c != ']' && c != '}') continue;
            if (open.empty() || open.back() != c) return fail(i, fmt::format("'{}' closes nothing", c));
            open.pop_back();
        }
        if (!open.empty()) return failAt(of_, tokens_.back().line, fmt::format("'{}' is missing", open.back()));
        return {};
    }

    /// Uniforms come out of the text, loops get their end.
    Expected<std::string> rewrite(PersonText& text) {
        std::string out;
        std::size_t written = 0;
        const auto upTo = [&](const char* place) {
            const auto at = static_cast<std::size_t>(place - text_.data());
            out += text_.substr(written, at - written);
            written = at;
        };
        for (std::size_t i = 0; i < tokens_.size(); ++i) {
            const Token& token = tokens_[i];
            if (token.is("uniform")) {
                if (auto good = takeUniform(i, text.uniforms); !good) return tl::unexpected(good.error());
                upTo(token.text.data());
                // Declared before both texts; the lines stay.
                const std::size_t end = static_cast<std::size_t>(tokens_[i + 3].text.data() - text_.data()) + 1;
                for (const char c : text_.substr(written, end - written)) out += c == '\n' ? '\n' : ' ';
                written = end;
                i += 3;
            } else if (token.is("while")) {
                text.loops = true;
                if (auto good = boundWhile(i, upTo, out); !good) return tl::unexpected(good.error());
            } else if (token.is("for")) {
                text.loops = true;
                if (auto good = boundFor(i, upTo, out); !good) return tl::unexpected(good.error());
            }
        }
        upTo(text_.data() + text_.size());
        return out;
    }

    [[nodiscard]] bool defines(std::string_view name) const {
        for (std::size_t i = 0; i + 2 < tokens_.size(); ++i)
            if (tokens_[i].is("void") && tokens_[i + 1].is(name) && tokens_[i + 2].is("(")) return true;
        return false;
    }

private:
    tl::unexpected<Error> fail(std::size_t token, std::string_view what) const {
        return failAt(of_, tokens_[token].line, what);
    }

    Expected<void> checkName(std::size_t i, bool atTop) const {
        const std::string_view name = tokens_[i].text;
        const bool member = i > 0 && tokens_[i - 1].is(".");
        if (name.find("__") != std::string_view::npos)
            return fail(i, fmt::format("'{}': two underscores are the compiler's own", name));
        if (name.size() > 128) return fail(i, "a name of more than 128 characters");
        if ((!member && std::ranges::find(kRefusedNames, name) != kRefusedNames.end()) ||
            std::ranges::any_of(kRefusedBeginnings, [&](std::string_view begins) { return name.starts_with(begins); }))
            return fail(i, fmt::format("'{}' is not for programs of materials", name));
        if (!member && atTop && (name == "in" || name == "out" || name == "inout"))
            return fail(
                i,
                fmt::format("'{}': a program has no inputs and outputs of its own; see WRITING.md for what it is given",
                            name));
        return {};
    }

    Expected<void> takeUniform(std::size_t i, std::vector<PersonUniform>& uniforms) const {
        if (i > 0 && !tokens_[i - 1].is(";") && !tokens_[i - 1].is("}"))
            return fail(i, "'uniform' stands in front of a declaration of its own");
        const auto type =
            i + 3 < tokens_.size() ? std::ranges::find(kUniformTypes, tokens_[i + 1].text) : kUniformTypes.end();
        if (type == kUniformTypes.end() || !tokens_[i + 2].isName() || !tokens_[i + 3].is(";"))
            return fail(i,
                        "a uniform is said as 'uniform TYPE NAME;', of float, vec2, vec3, vec4 or sampler2D, each by "
                        "itself and without a value");
        const PersonUniform uniform{.name = std::string(tokens_[i + 2].text),
                                    .width = static_cast<std::uint8_t>(type - kUniformTypes.begin())};
        const auto known = std::ranges::find(uniforms, uniform.name, &PersonUniform::name);
        if (known == uniforms.end())
            uniforms.push_back(uniform);
        else if (known->width != uniform.width)
            return fail(i, fmt::format("the uniform '{}' is of two types", uniform.name));
        if (uniforms.size() > kMostPersonUniforms)
            return fail(i, fmt::format("more than {} uniforms", kMostPersonUniforms));
        if (std::ranges::count(uniforms, 0, &PersonUniform::width) > static_cast<std::ptrdiff_t>(kMostPersonSamplers))
            return fail(i, fmt::format("more than {} samplers", kMostPersonSamplers));
        return {};
    }

    /// The token that closes the bracket at `i`; all close.
    [[nodiscard]] std::size_t closing(std::size_t i) const {
        int depth = 0;
        for (;; ++i) {
            const char c = tokens_[i].text[0];
            depth += c == '(' || c == '[' || c == '{';
            depth -= c == ')' || c == ']' || c == '}';
            if (depth == 0) return i;
        }
    }

    static constexpr std::string_view kCounted = "(tesseraRounds-- > 0) && (";

    /// `while (c)`, and what ends a `do`: `while ((counted) && (c))`.
    template <typename UpTo>
    Expected<void> boundWhile(std::size_t i, const UpTo& upTo, std::string& out) {
        if (i + 1 >= tokens_.size() || !tokens_[i + 1].is("(")) return fail(i, "'while' without its condition");
        const std::size_t end = closing(i + 1);
        if (end == i + 2) return fail(i, "'while' without its condition");
        return bound(i + 2, end, upTo, out);
    }

    /// `for (a; c; b)`: `for (a; (counted) && (c); b)`; no condition is `true`.
    template <typename UpTo>
    Expected<void> boundFor(std::size_t i, const UpTo& upTo, std::string& out) {
        if (i + 1 >= tokens_.size() || !tokens_[i + 1].is("(")) return fail(i, "'for' without its conditions");
        const std::size_t end = closing(i + 1);
        std::array<std::size_t, 2> semicolons{};
        std::size_t found = 0;
        int depth = 0;
        for (std::size_t k = i + 2; k < end; ++k) {
            const char c = tokens_[k].text[0];
            depth += c == '(' || c == '[' || c == '{';
            depth -= c == ')' || c == ']' || c == '}';
            if (depth == 0 && c == ';') {
                if (found == 2) return fail(k, "'for' with a third ';'");
                semicolons[found++] = k;
            }
        }
        if (found != 2) return fail(i, "'for' without its two ';'");
        if (semicolons[1] == semicolons[0] + 1) {
            upTo(tokens_[semicolons[1]].text.data());
            out += " tesseraRounds-- > 0";
            return {};
        }
        return bound(semicolons[0] + 1, semicolons[1], upTo, out);
    }

    template <typename UpTo>
    Expected<void> bound(std::size_t first, std::size_t end, const UpTo& upTo, std::string& out) {
        for (std::size_t k = first; k < end; ++k)
            if (tokens_[k].is("{") || tokens_[k].is("for") || tokens_[k].is("while") || tokens_[k].is("uniform"))
                return fail(k, "a loop's condition is an expression");
        upTo(tokens_[first].text.data());
        out += kCounted;
        upTo(tokens_[end].text.data());
        out += ')';
        return {};
    }

    std::string_view of_, text_;
    std::vector<Token> tokens_;
};

Expected<std::string> prepare(std::string_view of, std::string_view text, PersonText& out) {
    if (text.size() > kMostPersonBytes)
        return fail(ErrorCode::kLimit, fmt::format("{}: {} bytes, and {} may be", of, text.size(), kMostPersonBytes));
    const Expected<std::string> bare = withoutComments(text, of);
    if (!bare) return bare;
    if (bare->find_first_not_of(" \n") == std::string::npos) return std::string();
    Reader reader(of, *bare);
    if (auto good = reader.check(); !good) return tl::unexpected(good.error());
    if (!reader.defines(of))
        return fail(ErrorCode::kBadInput,
                    of == "surface"
                        ? "surface, line 1: there is no 'void surface(inout Surface s)'"
                        : "vertex, line 1: there is no 'void vertex(inout vec3 position, inout vec3 normal)'");
    return reader.rewrite(out);
}

}  // namespace

std::size_t PersonText::numbers() const {
    return uniforms.size() - static_cast<std::size_t>(std::ranges::count(uniforms, 0, &PersonUniform::width));
}

Expected<PersonText> preparePersonText(std::string_view surface, std::string_view vertex) {
    PersonText out;
    auto prepared = prepare("surface", surface, out);
    if (!prepared) return tl::unexpected(prepared.error());
    out.surface = std::move(*prepared);
    prepared = prepare("vertex", vertex, out);
    if (!prepared) return tl::unexpected(prepared.error());
    out.vertex = std::move(*prepared);
    std::ranges::stable_sort(
        out.uniforms, [](const PersonUniform& a, const PersonUniform& b) { return (a.width == 0) < (b.width == 0); });
    return out;
}

std::string personProblem(std::string_view log) {
    for (std::size_t at = 0; at < log.size();) {
        const std::size_t end = std::min(log.find('\n', at), log.size());
        std::string_view line = log.substr(at, end - at);
        at = end + 1;
        // "0:1000003(12): error: …" (Mesa), "0(1000003) : error …", "ERROR: 0:1000003: …" (others).
        for (std::size_t i = 0; i < line.size(); ++i) {
            if (!std::isdigit(static_cast<unsigned char>(line[i])) ||
                (i > 0 && std::isalnum(static_cast<unsigned char>(line[i - 1]))))
                continue;
            int number = 0;
            const auto [rest, error] = std::from_chars(line.data() + i, line.data() + line.size(), number);
            if (error != std::errc() || number <= kSurfaceLines || number >= kVertexLines + kSurfaceLines) continue;
            std::string_view what(rest, static_cast<std::size_t>(line.data() + line.size() - rest));
            if (const std::size_t colon = what.find(": "); colon != std::string_view::npos)
                what = what.substr(colon + 2);
            if (what.starts_with("warning")) break;
            if (what.starts_with("error: ")) what = what.substr(7);
            return fmt::format("{}, line {}: {}", number > kVertexLines ? "vertex" : "surface",
                               number - (number > kVertexLines ? kVertexLines : kSurfaceLines), what);
        }
    }
    const std::size_t first = log.find_first_not_of(" \n\t");
    if (first == std::string_view::npos) return "the compiler refuses it without a word";
    std::string_view line = log.substr(first, log.find('\n', first) - first);
    return fmt::format("it does not go with the rest of the shader (a name that is there already?): {}", line);
}

}  // namespace tessera
