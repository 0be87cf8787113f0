#include "client/replica/PartSharing.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

namespace tessera {
namespace {

constexpr int kGridPx = 64;
/// Of a picture that is divided, at most, and what one should take: each costs the list and some geometry once more.
constexpr std::size_t kMostPartsOfATile = 32;
static_assert(kMostPartsOfATile <= board::kMostParts);
constexpr std::chrono::milliseconds kPartShouldTake{4};
/// Frames that are compared: divided ones with undivided ones. So many good comparisons, then it is looked again how
/// long undivided ones take.
constexpr std::size_t kCompared = 3;
/// Divided frames that do not count: neighbours take up meshes, images and programs that they have not had.
constexpr unsigned kWarmUp = 3;
/// Of a frame, time that lies idle beside it: pieces make its processor time 5 to 8 % longer in dense scenes, and half
/// of this is gained.
constexpr Duration::rep kIdleShare = 6;
constexpr unsigned kGoodTrials = 16, kLongestPause = 256;

std::size_t pixelsOf(const PixelRect& rect) {
    return static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
}

/// The multiple of the grid nearest to the middle; nothing where none lies inside.
std::optional<int> middleOf(int from, int length) {
    const int middle = from + length / 2;
    int cut = (middle + kGridPx / 2) / kGridPx * kGridPx;
    if (cut >= from + length) cut -= kGridPx;
    if (cut <= from) cut += kGridPx;
    return cut > from && cut < from + length ? std::optional(cut) : std::nullopt;
}

std::optional<std::pair<PixelRect, PixelRect>> halved(const PixelRect& rect) {
    const auto x = middleOf(rect.x, rect.width), y = middleOf(rect.y, rect.height);
    PixelRect first = rect, second = rect;
    if (x && (!y || rect.width >= rect.height)) {
        first.width = *x - rect.x;
        second.x = *x;
        second.width -= first.width;
    } else if (y) {
        first.height = *y - rect.y;
        second.y = *y;
        second.height -= first.height;
    } else {
        return std::nullopt;
    }
    return std::pair(first, second);
}

PixelRect around(std::span<const PixelRect> parts) {
    PixelRect all = parts.front();
    for (const PixelRect& part : parts) {
        const int right = std::max(all.x + all.width, part.x + part.width),
                  top = std::max(all.y + all.height, part.y + part.height);
        all.x = std::min(all.x, part.x);
        all.y = std::min(all.y, part.y);
        all.width = right - all.x;
        all.height = top - all.y;
    }
    return all;
}

bool liesIn(const PixelRect& part, const PixelRect& whole) {
    return part.x >= whole.x && part.y >= whole.y && part.x + part.width <= whole.x + whole.width &&
           part.y + part.height <= whole.y + whole.height;
}

}  // namespace

Expected<ShareMode> parseShareMode(std::string_view name) {
    if (name == "off") return ShareMode::kOff;
    if (name == "auto") return ShareMode::kAuto;
    if (name == "always") return ShareMode::kAlways;
    return fail(ErrorCode::kUsage, fmt::format("'{}': off or auto", name));
}

std::vector<PixelRect> cutIntoParts(const PixelRect& tile, std::size_t count) {
    std::vector<PixelRect> parts{tile};
    std::vector<bool> whole{false};  // cannot be cut
    while (parts.size() < count) {
        std::size_t largest = parts.size();
        for (std::size_t i = 0; i < parts.size(); ++i)
            if (!whole[i] && (largest == parts.size() || pixelsOf(parts[i]) > pixelsOf(parts[largest]))) largest = i;
        if (largest == parts.size()) break;
        if (const auto halves = halved(parts[largest])) {
            parts[largest] = halves->first;
            parts.insert(parts.begin() + static_cast<std::ptrdiff_t>(largest) + 1, halves->second);
            whole.insert(whole.begin() + static_cast<std::ptrdiff_t>(largest) + 1, false);
        } else {
            whole[largest] = true;
        }
    }
    return parts;
}

void PartSharing::useWall(const Wall& wall, const std::string& host) {
    wall_ = wall;
    tiles_ = layoutTiles(wall_);
    const auto self = std::ranges::find(wall_.hosts, host, &WallHost::name);
    self_ = static_cast<HostIndex>(self - wall_.hosts.begin());
    // Who is there, this server says anew.
    neighbours_.clear();
    actions_.clear();
    forget();
    board_.withdraw();
    board_.is(Activity::kIdle);
}

void PartSharing::meet(const std::string& boards) {
    std::vector<Neighbour> before = std::exchange(neighbours_, {});
    for (std::size_t at = 0; at < boards.size();) {
        const std::size_t end = std::min(boards.find('\n', at), boards.size());
        const std::string line = boards.substr(at, end - at);
        at = end + 1;
        const std::size_t space = line.rfind(' ');
        if (space == std::string::npos) continue;
        Neighbour neighbour{.host = 0, .name = line.substr(0, space), .place = line.substr(space + 1), .board = {}};
        const auto host = std::ranges::find(wall_.hosts, neighbour.name, &WallHost::name);
        if (host == wall_.hosts.end()) continue;
        neighbour.host = static_cast<HostIndex>(host - wall_.hosts.begin());
        const auto known = std::ranges::find_if(before, [&](const Neighbour& old) {
            return old.board && old.host == neighbour.host && old.place == neighbour.place;
        });
        if (known != before.end()) {
            neighbour.board = std::move(known->board);
        } else if (auto opened = NeighbourBoard::open(neighbour.place)) {
            neighbour.board = std::move(*opened);
        } else {
            log_.info(
                fmt::format("no parts of pictures are shared with {}: {}", neighbour.name, opened.error().message));
            continue;
        }
        neighbours_.push_back(std::move(neighbour));
    }
}

void PartSharing::begin(FrameNumber frame, const Hash128& digest, const View& view) {
    frame_ = frame;
    digest_ = digest;
    view_ = view;
    begun_ = clockNow();
    frameCounts_ = {};
    drew_ = false;
    board_.is(Activity::kDrawing);
}

void PartSharing::end() {
    const TimePoint now = clockNow();
    board_.ready(frame_.value, now);
    board_.is(Activity::kIdle);
    judge(now);
}

bool PartSharing::divides() const {
    return options_.mode == ShareMode::kAlways || (options_.mode == ShareMode::kAuto && pays_ && !neighbours_.empty());
}

Expected<Picture> PartSharing::draw(Renderer& renderer, const Aspect& aspect, const DrawList& list,
                                    const ScreenCamera& camera, const Tile& tile,
                                    const std::function<Expected<Picture>()>& whole, PartCounts& counts) {
    Assembly assembly{.tile = tile, .drawHere = {}};
    assembly.drawHere = [&](const PixelRect& rect) {
        auto picture = renderer.draw(aspect, list, camera, rect);
        if (picture) assembly.light += renderer.lastLight(countedElsewhere(tiles_, tile));
        return picture;
    };
    const auto index = static_cast<std::uint32_t>(std::ranges::find(tiles_, tile.name, &Tile::name) - tiles_.begin());
    drew_ = true;
    if (divides()) assembly.parts = partsOf(tile, index);
    if (assembly.parts.size() < 2) {
        const TimePoint before = clockNow();
        auto picture = whole();
        wholeTook_[index] = clockNow() - before;
        return picture;
    }

    struct Withdrawal {
        Board& board;
        ~Withdrawal() { board.withdraw(); }
    } const withdrawal{board_};
    board_.post(digest_, index, assembly.parts);
    callIdle();
    if (auto done = assemble(assembly, counts); !done) return tl::unexpected(done.error());
    frameCounts_.parts += counts.parts;
    frameCounts_.helped += counts.helped;
    frameCounts_.twice += counts.twice;
    counts.light = assembly.light;
    return std::move(assembly.whole);
}

/// None where they are too large to be handed over.
std::vector<PixelRect> PartSharing::partsOf(const Tile& tile, std::uint32_t index) const {
    std::size_t count = kMostPartsOfATile;
    const auto took = wholeTook_.find(index);
    if (options_.mode == ShareMode::kAuto && took != wholeTook_.end())
        count =
            std::clamp<std::size_t>(std::bit_floor(static_cast<std::size_t>(took->second / kPartShouldTake)), 2, count);
    std::vector<PixelRect> parts = cutIntoParts(tile.rect, count);
    const bool fit =
        std::ranges::all_of(parts, [](const PixelRect& part) { return 3 * pixelsOf(part) <= board::kSlotBytes; });
    return fit ? parts : std::vector<PixelRect>();
}

Expected<void> PartSharing::assemble(Assembly& assembly, PartCounts& counts) {
    const std::size_t count = assembly.parts.size();
    counts.parts = assembly.missing = count;
    assembly.there.resize(count);
    assembly.distrusted.resize(count);
    assembly.whole = Picture{.widthPx = assembly.tile.rect.width, .heightPx = assembly.tile.rect.height, .rgb = {}};
    assembly.whole.rgb.resize(3 * pixelsOf(assembly.tile.rect));
    if (auto drawn = drawFree(assembly, counts); !drawn) return drawn;
    // Who has taken the others began before now. Where that lasts longer than it would here, and as long again, for a
    // neighbour that has not drawn such things before, it is not waited for.
    const TimePoint patience =
        clockNow() + 2 * assembly.ownTook / static_cast<Duration::rep>(std::max<std::size_t>(1, assembly.own));
    while (assembly.missing > 0) {
        const std::uint32_t seen = board_.doneCount();
        collect(assembly, counts);
        if (auto drawn = drawFree(assembly, counts); !drawn) return drawn;  // given back
        const TimePoint now = clockNow();
        if (assembly.missing == 0 || now >= patience) break;
        board_.waitForDone(seen, patience - now);
    }
    for (std::size_t part = 0; part < count; ++part) {
        collect(assembly, counts);
        if (assembly.there[part]) continue;
        ++counts.twice;
        if (auto drawn = drawRun(assembly, part, 1); !drawn) return drawn;
    }
    return {};
}

/// Takes and draws what is free, from the front: half of its share of what is missing at once, so ever smaller pieces.
/// What is left at any time can be shared out, though nobody knows what it costs, and little is spent on small pieces
/// while nobody helps (factoring: Hummel, Schonberg and Flynn 1992).
Expected<void> PartSharing::drawFree(Assembly& assembly, PartCounts& counts) {
    const std::size_t sharers = 1 + std::clamp<std::size_t>(std::min(neighbours_.size(), room() - 1), 1, 7);
    for (std::size_t first = 0; first < assembly.parts.size();) {
        const std::size_t share = std::max<std::size_t>(1, assembly.missing / (2 * sharers));
        std::size_t end = first;
        while (end < assembly.parts.size() && end - first < share && !assembly.there[end] && board_.take(end)) ++end;
        if (end == first) {
            ++first;
            continue;
        }
        while (first < end) {
            // As many as make a rectangle together.
            std::size_t count = end - first;
            for (; count > 1; --count) {
                const std::span<const PixelRect> run = std::span(assembly.parts).subspan(first, count);
                std::size_t pixels = 0;
                for (const PixelRect& part : run) pixels += pixelsOf(part);
                if (pixels == pixelsOf(around(run))) break;
            }
            if (auto drawn = drawRun(assembly, first, count); !drawn) return drawn;
            first += count;
            collect(assembly, counts);
        }
    }
    return {};
}

Expected<void> PartSharing::drawRun(Assembly& assembly, std::size_t first, std::size_t count) {
    const PixelRect rect = around(std::span(assembly.parts).subspan(first, count)), &tile = assembly.tile.rect;
    const TimePoint before = clockNow();
    const auto picture = assembly.drawHere(rect);
    if (!picture) return tl::unexpected(picture.error());
    paste(assembly.whole, *picture, rect.x - tile.x, tile.y + tile.height - rect.y - rect.height);
    std::fill_n(assembly.there.begin() + static_cast<std::ptrdiff_t>(first), count, true);
    assembly.missing -= count;
    assembly.own += count;
    assembly.ownTook += clockNow() - before;
    return {};
}

void PartSharing::collect(Assembly& assembly, PartCounts& counts) const {
    for (std::size_t part = 0; part < assembly.parts.size() && assembly.missing > 0; ++part) {
        if (assembly.there[part] || assembly.distrusted[part]) continue;
        const auto done = board_.doneElsewhere(part);
        if (!done) continue;
        const auto neighbour = std::ranges::find(neighbours_, done->by, &Neighbour::host);
        const auto light = neighbour == neighbours_.end()
                               ? std::nullopt
                               : neighbour->board->copy(done->slot, board_.stampOf(self_, part), assembly.parts[part],
                                                        assembly.tile.rect, assembly.whole);
        if (light) {
            assembly.light += *light;
            assembly.there[part] = true;
            --assembly.missing;
            ++counts.helped;
        } else {
            assembly.distrusted[part] = true;
        }
    }
}

bool PartSharing::neighboursDraw() const {
    return std::ranges::any_of(neighbours_,
                               [](const Neighbour& n) { return n.board->activity() == Activity::kDrawing; });
}

void PartSharing::callIdle() {
    for (Neighbour& neighbour : neighbours_)
        if (neighbour.board->activity() == Activity::kIdle) neighbour.board->call();
}

/// The tile of a posting that this host can draw parts of as its owner would.
const Tile* PartSharing::wantedTile(const Posting& posting) const {
    if (!digest_ || posting.digest != digest_ || posting.tile >= tiles_.size()) return nullptr;
    const Tile& tile = tiles_[posting.tile];
    const bool inside =
        std::ranges::all_of(posting.parts, [&](const PixelRect& part) { return liesIn(part, tile.rect); });
    return inside ? &tile : nullptr;
}

/// For one more that draws, beside all who do: of several that want to help at once the first in the wall goes first.
/// Up to two on each processor: who helps while all are busy makes nobody later, as what is left gets less for all; and
/// it is under way, warm, when the first of them is done. (Measured: README.)
bool PartSharing::processorFree() const {
    if (options_.mode == ShareMode::kAlways) return true;
    unsigned busy = 0;
    for (const Neighbour& neighbour : neighbours_) {
        const Activity activity = neighbour.board->activity();
        if (activity == Activity::kDrawing || (activity == Activity::kHelping && neighbour.host < self_)) ++busy;
    }
    return (busy + 1) * options_.threadsEach <= 2 * options_.cores;
}

bool PartSharing::help(Renderer& renderer, const Aspect& aspect, const RenderScene& scene,
                       const std::function<bool()>& wantedElsewhere) {
    if (!digest_ || options_.mode == ShareMode::kOff) return false;
    struct Helping {
        Board& board;
        explicit Helping(Board& b) : board(b) { board.is(Activity::kHelping); }
        ~Helping() { board.is(Activity::kIdle); }
    } const helping{board_};
    for (Neighbour& neighbour : neighbours_) {
        const auto posting = neighbour.board->look();
        const Tile* const tile = posting ? wantedTile(*posting) : nullptr;
        if (!tile || !processorFree()) continue;
        const auto part = neighbour.board->takeLast(*posting, self_);
        if (!part) continue;
        // No choice of culler changes a picture; those that ask the renderer remember more of a tile than parts are
        // worth.
        auto& action = actions_[posting->tile];
        if (!action)
            action = std::make_unique<RenderAction>(asksRenderer(wall_.culler) ? CullerKind::kAuto : wall_.culler);
        const PixelRect& rect = posting->parts[*part];
        const ScreenCamera camera = tileCamera(wall_, *tile, view_);
        const DrawList list = action->run(scene, camera, rect, nullptr);
        const auto picture = renderer.drawWhileWanted(aspect, list, camera, rect, wantedElsewhere);
        if (!picture)
            log_.warning(fmt::format("a part of {}'s picture cannot be drawn here: {}", neighbour.name,
                                     picture.error().message));
        if (!picture || !*picture) {
            neighbour.board->giveUp(*posting, *part, self_);
            return false;
        }
        const std::uint8_t slot = board_.keep(**picture, renderer.lastLight(countedElsewhere(tiles_, *tile)),
                                              Board::stamp(posting->number, neighbour.host, *part));
        (void)neighbour.board->done(*posting, *part, self_, slot);
        return true;
    }
    return false;
}

/// Hosts that can draw at once, each on processors of its own.
std::size_t PartSharing::room() const {
    return std::max<std::size_t>(1, options_.cores / std::max(1u, options_.threadsEach));
}

/// How long, until now, a processor and a neighbour had nothing to do, as far as the hosts of this wall tell.
Duration PartSharing::idleBeside(TimePoint now) const {
    std::vector<TimePoint> ready;
    for (const Neighbour& neighbour : neighbours_)
        if (const auto at = neighbour.board->readyWith(frame_.value)) ready.push_back(std::clamp(*at, begun_, now));
    std::ranges::sort(ready);
    // With n hosts and room for c of them a processor is free once fewer than c draw: when n + 1 - c are ready.
    const std::size_t hosts = neighbours_.size() + 1;
    const std::size_t wanted = hosts + 1 > room() ? hosts + 1 - room() : 1;
    return wanted <= ready.size() ? now - ready[wanted - 1] : Duration::zero();
}

/// Frames are divided once some show that time lay idle beside them, and as long as that makes them shorter.
void PartSharing::judge(TimePoint now) {
    if (options_.mode != ShareMode::kAuto || !drew_) return;
    if (frameCounts_.parts > 0) {
        if (++divided_ <= kWarmUp) return;
        trial_.took += now - begun_;
        trial_.counts.helped += frameCounts_.helped;
        trial_.counts.twice += frameCounts_.twice;
        if (++trial_.frames == kCompared) judgeTrial();
        return;
    }
    if (alone_.size() == kCompared) alone_.erase(alone_.begin());
    alone_.push_back(now - begun_);
    trial_ = {};
    divided_ = 0;
    if (pause_ > 0)
        --pause_;
    else
        pays_ = alone_.size() == kCompared &&
                idleBeside(now) > std::max<Duration>(options_.worthwhile, (now - begun_) / kIdleShare);
}

void PartSharing::judgeTrial() {
    const Trial trial = std::exchange(trial_, {});
    std::vector<Duration> alone = alone_;
    std::ranges::sort(alone);
    const Duration before = alone[alone.size() / 2];
    const bool shorter =
        trial.took / static_cast<Duration::rep>(kCompared) < before - before / 32;  // more than chance, mostly
    if (shorter && trial.counts.helped > trial.counts.twice) {
        nextPause_ = 8;
        if (++goodTrials_ < kGoodTrials) return;
    } else {
        pause_ = nextPause_;
        nextPause_ = std::min(2 * nextPause_, kLongestPause);
    }
    goodTrials_ = 0;
    pays_ = false;
    alone_.clear();
}

}  // namespace tessera
