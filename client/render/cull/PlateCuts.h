/// Questions about many plates at once, none about the same pixel twice.
#pragma once

#include <vector>

#include "client/render/cull/VisibilityDevice.h"

namespace tessera {

/// What a nearer plate covers need not be asked for again: if that one is hidden, so is what is behind it. Plates that
/// are likely hidden cut those behind them, of other questions too; an answer then rests on the answers to those
/// questions.
class PlateCuts {
public:
    struct Asked {
        VisibilityDevice::Plate plate;
        std::uint32_t question = 0;
        bool cuts = false;  ///< others: likely hidden
    };
    /// Of `questions` questions, numbered from 0.
    void cut(std::vector<Asked> plates, std::size_t questions);

    /// What is left to be asked, question by question; a question may have nothing left.
    [[nodiscard]] const std::vector<VisibilityDevice::Plate>& plates() const { return plates_; }
    [[nodiscard]] const std::vector<std::uint32_t>& sizes() const { return sizes_; }
    /// Other questions with a plate before one of this one's. Nothing of this one's plates shows if nothing does of
    /// what is left of it, and of them.
    [[nodiscard]] const std::vector<std::uint32_t>& restsOn(std::size_t question) const { return restsOn_[question]; }

private:
    void cutAway(const VisibilityDevice::Plate& nearer);

    std::vector<VisibilityDevice::Plate> plates_, pieces_, before_;
    std::vector<std::uint32_t> sizes_;
    std::vector<std::vector<std::uint32_t>> restsOn_;
    std::vector<std::vector<VisibilityDevice::Plate>> left_;
};

}  // namespace tessera
