/// The programs of persons that a renderer has met, and what materials say to them.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "client/draw/shaders/PersonText.h"
#include "client/draw/store/TextureCache.h"
#include "client/draw/store/UseClock.h"
#include "client/draw/surface/GlFunctions.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// What one material says to its program, by the places of PersonText::uniforms.
struct PersonValues {
    std::vector<std::array<float, 4>> numbers;
    struct Map {
        TextureCache::Found texture;  ///< null: white
        TextureCache::SamplerKey sampler = 0;
    };
    std::vector<Map> maps;
    float reach = 0;
};

/// Texture units of programs' samplers: no others', so that a sampler stays bound to its unit.
inline constexpr GLuint kPersonUnit = 24;

/// By their texts, as those change with every stroke in an editor. Not thread-safe.
class PersonPrograms {
public:
    /// kNone: it is drawn as the material says. kError: as what is wrong.
    static constexpr std::uint32_t kNone = 0, kError = 1;

    explicit PersonPrograms();
    /// What a material is drawn with: nothing before the server has tried its program, the error's where that is bad.
    /// Holds while `changes` stays as it is.
    struct Found {
        std::uint32_t drawn = kNone;  ///< with
        std::uint32_t known = kNone;  ///< the text's own number, whatever is drawn with
    };
    [[nodiscard]] Found find(const Aspect& aspect, const Material& material);
    /// A uniform that the material does not say is 0, an image that it does not say, or that is not here, white.
    [[nodiscard]] PersonValues valuesOf(const Aspect& aspect, const Material& material, std::uint32_t person,
                                        TextureCache& textures) const;
    [[nodiscard]] const PersonText& textOf(std::uint32_t person) const { return known_.at(person).text; }
    /// This host's GL refuses it, though the server's did not: from here on it is drawn as what is wrong.
    void refused(std::uint32_t person, std::string problem);
    /// It takes too long here: from here on it is drawn as the material says, until the server has said what it thinks
    /// of it, or it is another.
    void holdsUp(std::uint32_t person, Duration took);
    /// As Renderer::heldUpBy.
    [[nodiscard]] std::vector<HeldUpBy> heldUpBy(const Aspect& aspect);
    [[nodiscard]] bool isRefused(std::uint32_t person) const { return known_.at(person).refused; }
    /// Of the last that was refused; empty: none.
    [[nodiscard]] const std::string& trouble() const { return trouble_; }
    /// Grows when what `find` has said may be otherwise now, though no material is.
    [[nodiscard]] std::uint64_t changes() const { return changes_; }
    /// Grows when pictures may be others than before, though no material is: a program is refused, holds up or does so
    /// no longer. Not when programs are forgotten.
    [[nodiscard]] std::uint64_t verdicts() const { return verdicts_; }
    /// What an earlier draw has found, as Found::known, is needed in this one too.
    void use(std::uint32_t known) {
        if (known > kError) clock_.use(known_.at(known).uses);
    }
    /// As Renderer::beginFrame; a tile's, or a part's.
    void beginFrame() { clock_.beginFrame(); }
    void beginDraw() { clock_.beginDraw(); }
    /// Of more than kKept those that were not asked for in this frame and the one before, the longest unused first:
    /// they are forgotten, and their numbers never come again.
    [[nodiscard]] std::vector<std::uint32_t> forgetUnused();
    static constexpr std::size_t kKept = 128;

private:
    struct Known {
        PersonText text;
        bool refused = false;
        UseClock::Uses uses;
        ObjectId object;       ///< the last one of this text
        Duration heldUpFor{};  ///< 0: it does not
    };
    void judged();

    std::map<std::pair<std::string, std::string>, std::uint32_t> ids_;
    std::map<std::uint32_t, Known> known_;
    std::uint32_t next_ = kError + 1;
    std::string trouble_;
    std::uint64_t changes_ = 0, verdicts_ = 0;
    UseClock clock_;
};

}  // namespace tessera
