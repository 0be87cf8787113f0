#include "client/render/cull/CoherentCuller.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {

namespace {

/// Asked together at most: of what is known, and of what never was looked at. Those are best asked for when what stands
/// before them has been drawn, so few at a time.
constexpr std::size_t kMostPending = 512;
constexpr std::size_t kMostStrangers = 40;
/// Questions that are under way while the next ones are gathered.
constexpr std::size_t kMostUnderWay = 2;
/// What is seen is asked for again after 1 to this many frames.
constexpr std::uint32_t kLongestTrust = 10;
/// What a question costs, by the pixels of its plates and by itself, and drawing a picture's items (measured on two
/// cores, four samples; see COSTS.md). Only the ratios matter, and only for speed; a GPU's are about the same, each a
/// hundredth of it.
constexpr double kPixelNs = 4;
constexpr double kPlateNs = 2'000;
constexpr double kQuestionNs = 20'000;
constexpr double kPictureTriangleNs = 130;
constexpr double kPictureItemNs = 2'000;
/// How far below a node its question looks for boxes that cover less.
constexpr int kLevelsBelow = 1;

constexpr auto kAskedLater = [](const auto& a, const auto& b) { return a.sight.nearest < b.sight.nearest; };

/// How likely what has been hidden so many times in a row stays so (CHC++, equation 3: fitted by its authors).
double staysHidden(std::uint32_t hiddenFor) {
    return 0.99 - 0.7 * std::exp(-static_cast<double>(hiddenFor));
}

}  // namespace

CoherentCuller::Frame CoherentCuller::someFramesOn(std::uint32_t index) const {
    // Steele, Lea, Flood 2014: the mixing step of SplitMix.
    std::uint64_t mixed = (std::uint64_t{index} << 32 | frame_) * 0x9e3779b97f4a7c15ull;
    mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9ull;
    mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebull;
    return frame_ + 1 + static_cast<Frame>((mixed >> 33) % kLongestTrust);
}

void CoherentCuller::push(const Box& box) {
    nearestFirst_.push_back(box);
    std::push_heap(nearestFirst_.begin(), nearestFirst_.end(), kAskedLater);
}

/// Asking for what is drawn as fast is no gain (Guthe, Balázs, Klein 2006).
bool CoherentCuller::paysAsking(const PartView& view, const Box& item) {
    return kQuestionNs + kPixelNs * item.sight.plate.areaPx() <
           kPictureItemNs + kPictureTriangleNs * static_cast<double>(view.triangles(item.index));
}

/// The nearest of what is known so far: seen without a question, opened without one, or to be asked for.
void CoherentCuller::take(const PartView& view, const Box& box, DeviceWork& work) {
    const Memory& memory = memoryOf(box);
    const bool before = memory.seen + 1 == frame_;
    const bool certain = box.sight.fate == BoxSight::Fate::kTooNear;
    const bool asks = !certain && (!box.isItem || paysAsking(view, box));
    // What covers more than all that was drawn is not hidden, most likely (OpenSG 2 tells by this what it draws
    // untested).
    if (asks && !before && memory.hiddenFor == 0 && box.sight.plate.areaPx() > covered_ * view.areaPx()) {
        shown(view, box, work);
    } else if (box.isItem && (!asks || before)) {
        see(view, box, certain || asks, work);
        if (asks && memory.trusted < frame_) {
            Box again = box;
            again.again = again.alone = true;
            again.openedIn = static_cast<std::uint32_t>(seen_.size() - 1);
            pending_.push_back(again);
        }
    } else if (!box.isItem && (certain || before || memory.trusted >= frame_)) {
        open(view, box, false);
    } else {
        strangers_ += memory.hiddenFor == 0;
        pending_.push_back(box);
    }
}

void CoherentCuller::open(const PartView& view, const Box& node, bool asked) {
    const auto place = static_cast<std::uint32_t>(opened_.size());
    opened_.push_back({node.index, node.openedIn, asked, false, false});
    view.forEachBelow(node.index, node.sight.undecided, [&](const BoxSight& sight, std::uint32_t index, bool isItem) {
        push({.sight = sight, .index = index, .openedIn = place, .isItem = isItem});
    });
}

void CoherentCuller::see(const PartView& view, const Box& item, bool known, DeviceWork& work) {
    seen_.push_back({item.index, item.openedIn, known, false});
    if (!view.worthHidingWith(item.index, item.sight)) return;
    if (item.sight.fate == BoxSight::Fate::kAsk) covered_ += (1 - covered_) * item.sight.plate.areaPx() / view.areaPx();
    draws_.add(view, item.index);
    work.depthTriangles += view.triangles(item.index);
}

/// Groups of what has been hidden about as long, each as large as pays: benefit is the number of questions saved, cost
/// one question, and all of them again if anything shows (CHC++, section 4.2).
std::vector<CoherentCuller::Question> CoherentCuller::group() {
    std::vector<Question> questions;
    std::vector<Box> together;
    for (const Box& box : pending_) {
        if (box.alone || memoryOf(box).hiddenFor == 0)
            questions.push_back({.boxes = {box}});
        else
            together.push_back(box);
    }
    std::stable_sort(together.begin(), together.end(),
                     [&](const Box& a, const Box& b) { return memoryOf(a).hiddenFor > memoryOf(b).hiddenFor; });
    for (std::size_t first = 0; first < together.size();) {
        double allStay = staysHidden(memoryOf(together[first]).hiddenFor), bestWorth = 1;
        std::size_t best = 1;
        for (std::size_t size = 2; first + size <= together.size(); ++size) {
            allStay *= staysHidden(memoryOf(together[first + size - 1]).hiddenFor);
            const double worth = static_cast<double>(size) / (1 + (1 - allStay) * static_cast<double>(size));
            if (worth < bestWorth) break;
            bestWorth = worth;
            best = size;
        }
        questions.push_back({.boxes = {together.begin() + static_cast<std::ptrdiff_t>(first),
                                       together.begin() + static_cast<std::ptrdiff_t>(first + best)}});
        first += best;
    }
    pending_.clear();
    strangers_ = 0;
    return questions;
}

/// The box's own plate, or those of what lies in it, whichever are drawn faster. Returns their cost.
double CoherentCuller::addPlates(const PartView& view, const Box& box, int levels) {
    const std::size_t before = plates_.size();
    const double own = kPlateNs + kPixelNs * box.sight.plate.areaPx();
    if (!box.isItem && levels > 0) {
        double below = 0;
        view.forEachBelow(box.index, box.sight.undecided, [&](const BoxSight& sight, std::uint32_t index, bool isItem) {
            // What is too near has no plate; what holds it has none either, but for rounding.
            below += sight.fate == BoxSight::Fate::kTooNear
                         ? std::numeric_limits<double>::infinity()
                         : addPlates(view, {.sight = sight, .index = index, .isItem = isItem}, levels - 1);
        });
        if (plates_.size() > before && below < own) return below;
        plates_.resize(before);
    }
    plates_.push_back(box.sight.plate);
    return own;
}

Expected<void> CoherentCuller::ask(const PartView& view, VisibilityDevice& device, DeviceWork& work) {
    if (auto drawn = draws_.draw(device); !drawn) return drawn;
    if (pending_.empty()) return {};
    std::vector<Question> questions = group();
    std::vector<PlateCuts::Asked> asked;
    for (std::size_t i = 0; i < questions.size(); ++i) {
        for (const Box& box : questions[i].boxes) {
            plates_.clear();
            addPlates(view, box, kLevelsBelow);
            const bool cuts = !box.alone && memoryOf(box).hiddenFor > 0;
            for (const VisibilityDevice::Plate& plate : plates_)
                asked.push_back({.plate = plate, .question = static_cast<std::uint32_t>(i), .cuts = cuts});
        }
    }
    cuts_.cut(std::move(asked), questions.size());
    const auto first = device.ask(cuts_.plates(), cuts_.sizes());
    if (!first) return tl::unexpected(first.error());
    for (std::size_t i = 0; i < questions.size(); ++i) {
        questions[i].ticket = *first + static_cast<VisibilityDevice::Ticket>(i);
        questions[i].restsOn = cuts_.restsOn(i);
    }
    work.queries += questions.size();
    asked_.push_back(std::move(questions));
    return {};
}

Expected<void> CoherentCuller::takeAnswers(const PartView& view, VisibilityDevice& device, DeviceWork& work) {
    std::vector<Question> questions = std::move(asked_.front());
    asked_.pop_front();
    ++work.waits;
    for (Question& question : questions) {
        const auto shows = device.answer(question.ticket);
        if (!shows) return tl::unexpected(shows.error());
        question.shows = *shows;
    }
    for (const Question& question : questions) {
        const bool unproven = std::any_of(question.restsOn.begin(), question.restsOn.end(),
                                          [&](std::uint32_t other) { return questions[other].shows; });
        if (question.shows && question.boxes.size() == 1) {
            shown(view, question.boxes.front(), work);
        } else if (question.shows) {
            for (Box box : question.boxes) {
                box.alone = true;
                pending_.push_back(box);
            }
        } else if (unproven) {
            pending_.insert(pending_.end(), question.boxes.begin(), question.boxes.end());
        } else {
            for (const Box& box : question.boxes) {
                if (box.again) seen_[box.openedIn].hidden = true;
                Memory& memory = memoryOf(box);
                ++memory.hiddenFor;
                memory.trusted = 0;
            }
        }
    }
    return {};
}

void CoherentCuller::shown(const PartView& view, const Box& box, DeviceWork& work) {
    Memory& memory = memoryOf(box);
    memory.hiddenFor = 0;
    if (box.again) {
        memory.trusted = someFramesOn(box.index);
    } else if (box.isItem) {
        memory.trusted = someFramesOn(box.index);
        see(view, box, true, work);
    } else {
        open(view, box, true);
    }
}

/// From the leaves up: who holds something that is seen.
void CoherentCuller::finish(std::vector<std::uint32_t>& visible) {
    for (const Seen& seen : seen_) {
        if (seen.hidden) continue;
        visible.push_back(seen.item);
        if (seen.known) items_[seen.item].seen = frame_;
        if (seen.openedIn == kNone) continue;
        Opened& in = opened_[seen.openedIn];
        (seen.known ? in.anythingSeen : in.anythingUnasked) = true;
    }
    for (std::size_t i = opened_.size(); i-- > 0;) {
        const Opened& node = opened_[i];
        Memory& memory = nodes_[node.node];
        // What was not asked for itself is taken for what its node showed, until that is asked again.
        if (node.anythingUnasked && node.asked) memory.trusted = someFramesOn(node.node) + kLongestTrust;
        if (node.anythingSeen || (node.anythingUnasked && memory.trusted >= frame_)) {
            memory.seen = frame_;
            memory.hiddenFor = 0;
            if (node.openedIn != kNone) opened_[node.openedIn].anythingSeen = true;
        } else if (node.asked) {
            // Its box shows and nothing in it does: the question is not worth asking each time.
            memory.trusted = someFramesOn(node.node);
        }
    }
}

Expected<void> CoherentCuller::cull(const PartView& view, VisibilityDevice& device, std::vector<std::uint32_t>& visible,
                                    DeviceWork& work) {
    ++frame_;
    if (rebuilds_ != view.rebuilds()) {
        rebuilds_ = view.rebuilds();
        nodes_.clear();
        items_.clear();
    }
    nodes_.resize(view.tree().slots());
    items_.resize(view.itemSlots());
    nearestFirst_.clear();
    pending_.clear();
    asked_.clear();
    opened_.clear();
    seen_.clear();
    draws_.forget();
    strangers_ = 0;
    covered_ = 0;
    if (view.tree().empty()) return {};
    const BoxSight all = view.node(BoxTree::kRoot, Frustum::kAllPlanes);
    if (all.fate == BoxSight::Fate::kBeside) return {};
    push({.sight = all, .index = BoxTree::kRoot});
    while (!nearestFirst_.empty() || !pending_.empty() || !asked_.empty()) {
        while (!nearestFirst_.empty() && pending_.size() < kMostPending && strangers_ < kMostStrangers) {
            std::pop_heap(nearestFirst_.begin(), nearestFirst_.end(), kAskedLater);
            const Box box = nearestFirst_.back();
            nearestFirst_.pop_back();
            take(view, box, work);
        }
        if (auto done = ask(view, device, work); !done) return done;
        if (nearestFirst_.empty() || asked_.size() >= kMostUnderWay) {
            if (asked_.empty()) continue;
            if (auto taken = takeAnswers(view, device, work); !taken) return taken;
        }
    }
    finish(visible);
    return {};
}

}  // namespace tessera
