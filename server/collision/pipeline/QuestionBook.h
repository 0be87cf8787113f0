/// What applications have been asked, and what they have decided.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <tuple>
#include <vector>

#include "server/collision/pipeline/StepResult.h"

namespace tessera {

/// Whatever an application does or does not do, the frame goes on: a motion that it was asked about stands stopped
/// until its reply, or until the interest's patience is over; then it stays stopped, and nobody is asked again as long
/// as it presses on in every frame. Not thread-safe.
class QuestionBook {
public:
    /// Two objects and the transform that would lead them into each other.
    struct Matter {
        ObjectId transform, objectA, objectB;
        auto operator<=>(const Matter&) const = default;
    };

    /// Takes the replies of a frame (the first one to a question counts; those to unknown ones are ignored) and returns
    /// what they set going, ascending by transform.
    [[nodiscard]] std::vector<TentativeTransform> take(std::span<const Reply> replies);

    /// An application lets this pair pass: it is no obstacle.
    [[nodiscard]] bool passes(const Matter& matter) const;
    /// A motion has been stopped. Appends a question where there has to be one.
    void stopped(const Matter& matter, const Question& question, std::int64_t patience, std::size_t maxOpen,
                 std::vector<Question>& asked);
    /// Ends a frame: patience runs out; a stop is forgotten when nobody pressed on, a passage when it is over.
    /// `inTouch` says whether a matter's objects touch now. Returns how many questions went unanswered.
    template <typename InTouch>
    [[nodiscard]] std::uint64_t endFrame(const InTouch& inTouch);

    /// Nothing is asked, stands stopped or passes.
    [[nodiscard]] bool empty() const { return entries_.empty(); }
    /// Ids of questions that wait for a reply, ascending.
    [[nodiscard]] std::vector<std::uint64_t> open() const;

private:
    enum class Standing : std::uint8_t { kAsked, kStopped, kPassing };
    struct Entry {
        Standing standing = Standing::kAsked;
        Question question;
        std::int64_t framesLeft = 0;
        bool pressed = true;  ///< in this frame: decided or stopped
    };
    std::map<Matter, Entry> entries_;
    std::uint64_t nextId_ = 1;
};

template <typename InTouch>
std::uint64_t QuestionBook::endFrame(const InTouch& inTouch) {
    std::uint64_t unanswered = 0;
    for (auto it = entries_.begin(); it != entries_.end();) {
        Entry& entry = it->second;
        if (entry.standing == Standing::kAsked) {
            if (--entry.framesLeft < 0) {
                entry.standing = Standing::kStopped;
                ++unanswered;
            }
        } else if (entry.standing == Standing::kStopped ? !entry.pressed : !inTouch(it->first)) {
            it = entries_.erase(it);
            continue;
        }
        entry.pressed = false;
        ++it;
    }
    return unanswered;
}

}  // namespace tessera
