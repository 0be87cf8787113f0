/// Small pictures of the wall for those who look at it from elsewhere: a page, a program.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/wall/Wall.h"
#include "server/sim/desk/Answering.h"

namespace tessera {

/// Each who looks asks for what has changed since its last answer, and is answered once something has, or after
/// kNothing. So nothing queues: a slow reader sees fewer pictures, always the newest, and only its own become fewer.
///
/// All who look at one size share one question to the hosts, at most each kPace; hosts shrink and encode, and send no
/// tile that shows what was sent. A tile that takes longer than kRound keeps the others from nobody. While nobody looks
/// nobody is asked. Holds the newest picture of each tile and size, for kForgotten after the last look. Frame thread
/// only.
class PreviewRequests {
public:
    static constexpr std::chrono::milliseconds kPace{66}, kRound{250}, kNothing{5'000}, kForgotten{10'000};
    static constexpr std::size_t kMostBytes = std::size_t{4} << 20;  ///< of a tile's picture; larger ones are left out
    static constexpr std::size_t kMostSizes = 3;  ///< at once; whoever wants another one has the nearest of these
    /// Numbers of questions to hosts that are these.
    [[nodiscard]] static constexpr bool isOurs(std::uint64_t request) { return request >> 63 != 0; }

    PreviewRequests(const Wall& wall, ServerSession& session);

    [[nodiscard]] ServerActions ask(const Asker& asker, std::uint32_t shrink, std::uint64_t after, TimePoint now);
    [[nodiscard]] ServerActions imageReceived(const server_action::ImageReceived& image, TimePoint now);
    [[nodiscard]] ServerActions advance(TimePoint now);
    [[nodiscard]] TimePoint nextDeadline() const;
    void applicationLeft(ConnectionId connection);
    /// Of one application.
    [[nodiscard]] std::size_t openCount(ConnectionId connection) const;

private:
    struct Seen {
        answer::TilePreview preview;
        std::uint64_t stamp = 0;
    };
    struct Waiting {
        Asker asker;
        std::uint64_t after = 0;
        TimePoint until;
    };
    /// All hosts have been asked for what is new.
    struct Round {
        std::uint64_t number = 0;
        TimePoint until;
        std::set<std::string> awaited;  ///< tiles
    };
    struct Size {
        std::map<std::string, Seen> tiles;
        std::vector<Waiting> waiting;
        std::optional<Round> round;
        TimePoint next{}, looked{};
        bool known = false;  ///< hosts know what was sent last
    };
    using Sizes = std::map<std::uint32_t, Size>;

    [[nodiscard]] Sizes::iterator sizeFor(std::uint32_t shrink);
    [[nodiscard]] std::set<std::string> liveHosts() const;
    void answerWhoCan(Size& size, TimePoint now, ServerActions& actions);
    void begin(std::uint32_t shrink, Size& size, TimePoint now, ServerActions& actions);

    ServerSession& session_;
    std::map<std::string, std::string> hostOf_;  ///< of each tile
    std::uint64_t stamp_ = 0, rounds_ = 0;
    Sizes sizes_;
};

}  // namespace tessera
