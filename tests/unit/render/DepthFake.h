/// Depths as the cullers ask for them, without GL: every triangle against every sample, in double, plates against
/// those.
#pragma once

#include <optional>

#include "client/render/cull/VisibilityDevice.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Each pixel has the samples of VisibilityOracle.h. Tiles are cut into parts of `partPx` columns.
class DepthFake : public VisibilityDevice {
public:
    explicit DepthFake(const Aspect& aspect, int partPx = 1 << 20) : aspect_(aspect), partPx_(partPx) {}

    [[nodiscard]] std::vector<Part> partsOf(const ScreenCamera& screen, const PixelRect& rect) const override;
    [[nodiscard]] Expected<void> begin(const Part& part) override;
    [[nodiscard]] Expected<void> drawDepth(std::span<const DrawItem> items) override;
    [[nodiscard]] Expected<Ticket> ask(std::span<const Plate> plates, std::span<const std::uint32_t> sizes) override;
    [[nodiscard]] Expected<bool> answer(Ticket ticket) override;
    [[nodiscard]] Expected<std::span<const float>> farthest() override;

    /// Calls from now on until one fails, as a renderer does that GL has given up.
    std::optional<int> callsLeft;

private:
    static constexpr int kSamples = 20;
    [[nodiscard]] Expected<void> call();
    void draw(const DrawItem& item);

    const Aspect& aspect_;
    int partPx_;
    Part part_;
    std::vector<float> depths_;  ///< by pixel of the part and sample
    std::vector<float> farthest_;
    std::vector<bool> answers_;
};

}  // namespace tessera
