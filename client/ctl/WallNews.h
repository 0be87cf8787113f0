/// What happens to a wall, in lines: what the server tells now beside what it has told before.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/ctl/Answer.h"
#include "common/request/EditRequests.h"
#include "common/request/StatusRequests.h"

namespace tessera {

struct WallEvent {
    std::string kind;  ///< host, frame, person, edit, journal, program, detail
    std::string text;
    nlohmann::ordered_json json;  ///< what the text says, without the kind
};

/// Each answer or notice is given to it as it comes. The first of a kind only says how things are: nothing has happened
/// yet. What has happened since is taken from it.
class WallNews {
public:
    /// True: people have come or gone, and `people` wants to be asked.
    [[nodiscard]] bool states(const notice::States& now);
    void people(const answer::People& now);
    void frame(const notice::Frame& now);
    /// True: the scene is another, and `steps` wants to be asked.
    [[nodiscard]] bool status(const answer::Status& now);
    void steps(const answer::Steps& now);

    /// In their order.
    [[nodiscard]] std::vector<WallEvent> take() { return std::exchange(events_, {}); }

private:
    void happened(std::string kind, std::string text, nlohmann::ordered_json json) {
        events_.push_back({std::move(kind), std::move(text), std::move(json)});
    }
    void lines(const char* kind, std::vector<std::string>& known, const std::vector<std::string>& now);

    std::vector<WallEvent> events_;
    std::optional<notice::States> states_;
    struct Known {
        std::string name, program, role;
        auto operator<=>(const Known&) const = default;
    };
    std::optional<std::multiset<Known>> people_;
    std::set<std::string> holding_;  ///< hosts
    std::optional<answer::Status> status_;
    std::optional<answer::Steps> steps_;
    std::uint64_t depth_ = 0;  ///< of undo, with them
};

}  // namespace tessera
