#include "common/drawable/ProgramImages.h"

#include <algorithm>
#include <cctype>

namespace tessera {
namespace {

/// Words and single signs of GLSL.
class GlslWords {
public:
    explicit GlslWords(std::string_view text) : rest_(text) {}

    /// Empty at the end.
    std::string_view next() {
        for (;;) {
            rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n\v\f"), rest_.size()));
            if (rest_.starts_with("//"))
                rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
            else if (rest_.starts_with("/*"))
                rest_.remove_prefix(std::min(rest_.find("*/", 2), rest_.size() - 2) + 2);
            else
                break;
        }
        const auto inWord = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
        const auto end = std::ranges::find_if_not(rest_, inWord);
        const std::string_view word = rest_.substr(
            0, std::max<std::size_t>(static_cast<std::size_t>(end - rest_.begin()), rest_.empty() ? 0 : 1));
        rest_.remove_prefix(word.size());
        return word;
    }

private:
    std::string_view rest_;
};

}  // namespace

bool declaresSampler(std::string_view text, std::string_view name) {
    GlslWords words(text);
    std::string_view before, last;
    for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
        if (word == name && last == "sampler2D" && before == "uniform") return true;
        before = last;
        last = word;
    }
    return false;
}

std::optional<ObjectId> uniformOfAnotherShape(const Aspect& scene, const Material& material) {
    const auto* program = material.program ? scene.get<SurfaceProgram>(material.program) : nullptr;
    if (!program) return std::nullopt;
    for (const ObjectId id : material.uniforms) {
        const auto* uniform = scene.get<Uniform>(id);
        const auto* image = uniform && uniform->image ? scene.get<Image>(uniform->image) : nullptr;
        if (!image || (image->shape != Image::kCube && image->shape != Image::kSolid)) continue;
        if (declaresSampler(program->surface, uniform->name) || declaresSampler(program->vertex, uniform->name))
            return id;
    }
    return std::nullopt;
}

}  // namespace tessera
