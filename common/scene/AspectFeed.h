/// One writer, any number of readers in threads of their own, and nobody waits: OpenSG's aspects.
///
///     AspectFeed feed;                                       // the writer's thread
///     std::unique_ptr<AspectReader> reader = feed.join(scene);  // handed to another thread, which owns it from then
///     on feed.publish(scene, list);                             // after every list that was applied
///
///     while (reader->catchUp()) look(reader->scene());       // the other thread, whenever it likes
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/Channel.h"
#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// A state of the scene, and the list that leads there from the one before.
struct PublishedState {
    std::uint64_t number = 0;  ///< of the list that was published last, counted from 1
    StateHash hash;
    ChangeListPtr list;
};

/// A reader's own copy of the scene. It is always as the writer's was after some list, whole; arrays are the writer's,
/// shared. One thread owns it.
class AspectReader {
public:
    /// Applies all that has come. False: nothing had. kFailed: it is not what the writer had (a list was left out
    /// there), and no more comes.
    [[nodiscard]] Expected<bool> catchUp();
    [[nodiscard]] const Aspect& scene() const { return scene_; }
    /// Of the list that it is as of; 0: as it was when it joined.
    [[nodiscard]] std::uint64_t number() const { return number_; }
    ~AspectReader();

private:
    friend class AspectFeed;
    using Mailbox = Channel<PublishedState>;
    AspectReader(Aspect scene, std::uint64_t number, std::shared_ptr<Mailbox> mailbox)
        : scene_(std::move(scene)), number_(number), mailbox_(std::move(mailbox)) {}

    Aspect scene_;
    std::uint64_t number_ = 0;
    std::shared_ptr<Mailbox> mailbox_;
};

/// The writer's side; one thread owns it. What it costs per list does not depend on the scene, nor on who reads how
/// slowly: of what a reader does not take, kQueued lists wait as they came, and the others become one list of like
/// effect, pair by pair of like size, so that what is kept for a reader that sleeps is in proportion to the scene and
/// not to the time. What waits so goes on with the next `publish`; an empty list will do.
class AspectFeed {
public:
    static constexpr std::size_t kQueued = 16;

    /// A reader that is as `scene` is. Costs a copy of the scene, arrays not counted.
    [[nodiscard]] std::unique_ptr<AspectReader> join(const Aspect& scene);
    /// `scene`: as it is after the list. `list` may be null: nothing has changed.
    void publish(const Aspect& scene, ChangeListPtr list);

    /// Those that have not gone, as of the last `publish`.
    [[nodiscard]] std::size_t readers() const { return readers_.size(); }
    /// Lists that wait beside the queues, of all readers.
    [[nodiscard]] std::size_t waiting() const;

private:
    struct Reader {
        std::shared_ptr<AspectReader::Mailbox> mailbox;
        std::vector<PublishedState> waiting;
    };
    std::vector<Reader> readers_;
    std::uint64_t number_ = 0;
};

}  // namespace tessera
