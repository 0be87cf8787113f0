/// The culler `queries`: questions to the renderer within one traversal from front to back, asked many at a time.
#pragma once

#include <deque>

#include "client/render/cull/PartCuller.h"
#include "client/render/cull/PlateCuts.h"

namespace tessera {

/// The thesis' way, queries organised in the traversal (Fünfzig 2007), with CHC++'s economy (Mattausch, Bittner, Wimmer
/// 2008): what was seen in the frame before is drawn for depth without a question and asked for again now and then;
/// what was hidden is asked for in groups, the larger the longer all in them have been hidden; a node of which nothing
/// showed counts as hidden itself; a node's question is about what lies in it where that covers less, and about no
/// pixel that a nearer box is asked for which was hidden, too. Answers are waited for when there is nothing else to do.
///
/// Unlike there, who is hidden is decided in the frame itself: what is remembered says what is asked and when, never
/// what comes out. When is chosen by a hash, not by a clock.
class CoherentCuller : public PartCuller {
public:
    [[nodiscard]] Expected<void> cull(const PartView& view, VisibilityDevice& device,
                                      std::vector<std::uint32_t>& visible, DeviceWork& work) override;

private:
    using Frame = std::uint32_t;
    /// Of a node or an item, in frames of this culler.
    struct Memory {
        Frame seen = 0;  ///< last; of a node: something in it
        Frame trusted =
            0;  ///< until then it is not asked for again while it is seen; a node: opened without a question
        std::uint32_t hiddenFor = 0;  ///< times in a row
    };
    static constexpr std::uint32_t kNone = 0xffffffffu;
    struct Box {
        BoxSight sight;
        std::uint32_t index = 0;
        std::uint32_t openedIn = kNone;  ///< of `opened_`: the node it was found in
        bool isItem = false;
        bool again = false;  ///< counts as seen; the question is whether it still is
        bool alone = false;  ///< not to be grouped any more
    };
    /// A node that was opened in this frame.
    struct Opened {
        std::uint32_t node, openedIn;
        bool asked, anythingSeen;
        bool anythingUnasked;  ///< drawn because that costs less than a question: maybe seen
    };
    struct Seen {
        std::uint32_t item, openedIn;
        bool known;   ///< not only because asking would cost more than drawing it
        bool hidden;  ///< found out later
    };
    struct Question {
        std::vector<Box> boxes;
        std::vector<std::uint32_t> restsOn;  ///< others of the same batch
        VisibilityDevice::Ticket ticket = 0;
        bool shows = false;
    };

    [[nodiscard]] Memory& memoryOf(const Box& box) { return box.isItem ? items_[box.index] : nodes_[box.index]; }
    [[nodiscard]] Frame someFramesOn(std::uint32_t index) const;
    [[nodiscard]] static bool paysAsking(const PartView& view, const Box& item);
    void push(const Box& box);
    void take(const PartView& view, const Box& box, DeviceWork& work);
    void open(const PartView& view, const Box& node, bool asked);
    void see(const PartView& view, const Box& item, bool known, DeviceWork& work);
    [[nodiscard]] Expected<void> ask(const PartView& view, VisibilityDevice& device, DeviceWork& work);
    [[nodiscard]] std::vector<Question> group();
    double addPlates(const PartView& view, const Box& box, int levels);
    [[nodiscard]] Expected<void> takeAnswers(const PartView& view, VisibilityDevice& device, DeviceWork& work);
    void shown(const PartView& view, const Box& box, DeviceWork& work);
    void finish(std::vector<std::uint32_t>& visible);

    std::vector<Memory> nodes_, items_;
    std::uint64_t rebuilds_ = 0;  ///< of the scene that the memory is of
    Frame frame_ = 1;

    // Of the frame at hand.
    std::vector<Box> nearestFirst_;  ///< a heap
    std::vector<Box> pending_;       ///< to be asked for
    std::size_t strangers_ = 0;      ///< of these the ones of which nothing is known
    double covered_ = 0;             ///< roughly: share of the part that is drawn for depth
    std::deque<std::vector<Question>> asked_;
    std::vector<Opened> opened_;
    std::vector<Seen> seen_;
    DepthDraws draws_;
    std::vector<VisibilityDevice::Plate> plates_;
    PlateCuts cuts_;
};

}  // namespace tessera
