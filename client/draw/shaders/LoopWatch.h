/// Ends what a person's program does without end, while GL draws it: a rasteriser cannot be told to stop, loops can.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <thread>

#include "client/draw/surface/GlState.h"
#include "common/base/Channel.h"
#include "common/base/Clock.h"

namespace tessera {

/// How many rounds loops of persons' programs may go (PersonText.h) is read from memory at the start of each pixel and
/// vertex, and GL and this process see the same memory: a thread writes 0 there when what is being drawn takes too
/// long, and what has not begun by then goes no round. What has begun ends by itself: eight pixels at a time, on a
/// processor.
///
/// On processors time counts only if some thread of this process had one for half of it: others that want them, too,
/// are nobody's fault here, and of threads that draw at once the one that works longest says how long it takes. Belongs
/// to the surface's thread, but for that one write.
class LoopWatch {
public:
    /// `onProcessor`: GL draws with the processors of this machine. The surface is current.
    LoopWatch(GlState& gl, bool onProcessor);
    /// The surface is current, or gone.
    ~LoopWatch();
    LoopWatch(const LoopWatch&) = delete;
    LoopWatch& operator=(const LoopWatch&) = delete;

    /// Where programs find it.
    static constexpr GLuint kBinding = 0;
    void bind() { gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kBinding, buffer_); }

    /// From here on until `end` for so long at most. GL has finished what was before. Where the system has no thread
    /// for it, nothing is watched.
    void begin(Duration most);
    /// GL has finished what is watched. How long it took.
    Duration end();
    /// Whether anything was ended since the last `letGo`: what was drawn then is no picture.
    [[nodiscard]] bool stopped() const { return stopped_; }
    /// Loops may go as many rounds as ever.
    void letGo();

private:
    struct Watch {
        TimePoint begun;
        Duration most{};
    };
    void run();
    void write(std::int32_t rounds) const;
    using ThreadTimes = std::map<int, Duration>;  ///< on processors, by thread
    [[nodiscard]] static ThreadTimes threadTimes();
    [[nodiscard]] bool isOver(const Watch& watch, const ThreadTimes& before) const;

    GlState& gl_;
    bool onProcessor_;
    GLuint buffer_ = 0;
    std::int32_t* rounds_ = nullptr;  ///< GL's memory

    Channel<std::optional<Watch>> told_{1};  ///< nothing: that is over
    Channel<bool> ended_{1};                 ///< whether it was ended
    bool watching_ = false, stopped_ = false;
    TimePoint begun_{};
    std::thread thread_;  ///< from the first `begin` on
};

}  // namespace tessera
