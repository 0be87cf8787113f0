/// One film, decoded by a process of its own: the server parses no stranger's pictures.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "common/base/Blob.h"
#include "common/base/ChildProgram.h"
#include "common/base/Clock.h"
#include "common/base/Error.h"
#include "common/base/FileHandle.h"
#include "server/movies/FilmRecords.h"

namespace tessera {

/// A picture as an Image holds it.
struct FilmFrame {
    std::uint64_t serial = 0;   ///< of the request
    double begin = 0, end = 0;  ///< s from the film's start
    double seconds = 0;         ///< the film's length as far as it is known; 0: it is not
    bool wrapped = false;       ///< it is the first one, and came after the last
    Blob pixels;
    std::int64_t widthPx = 0, heightPx = 0, encoding = 0, mipmaps = 1;
};

/// While it lives, so does a child (tessera-decode-film, which gives everything away before it looks at the file): it
/// is killed and reaped at the latest when this goes. Nothing waits for it; who has not answered a request after
/// kSeconds is killed, and who works for kIdleSeconds while nothing is asked. Believes nothing: sizes are checked,
/// pictures copied before they are looked at. Not thread-safe; the child ends with the thread that starts it.
class FilmProcess {
public:
    static constexpr int kSeconds = 20;
    static constexpr int kIdleSeconds = 2;  ///< of the processor: some decode ahead
    static constexpr std::size_t kMostUnderWay = 2;

    /// `film`: open for reading. `program`: the decoder; empty: beside the running program.
    [[nodiscard]] static Expected<FilmProcess> start(FileHandle film, const std::string& program);

    [[nodiscard]] std::size_t underWay() const { return pending_.size(); }
    /// `request`: its flags and seconds count. Only where fewer than kMostUnderWay are under way. Returns its serial.
    std::uint64_t ask(FilmRequest request, TimePoint now);
    /// What has been answered since, in the order of the requests. Fails, once and for good, with why there will be no
    /// more, in words for a person. `patience`: waits as long for each answer that is to come.
    [[nodiscard]] Expected<std::vector<FilmFrame>> poll(TimePoint now, Duration patience = {});
    /// The child's; for tests that end it.
    [[nodiscard]] pid_t process() const { return child_.pid(); }

private:
    FilmProcess() = default;
    [[nodiscard]] Expected<FilmFrame> take(const FilmAnswer& answer);
    [[nodiscard]] Error ended();
    /// Of the processor, since it was started.
    [[nodiscard]] Duration worked() const;

    struct Asked {
        std::uint64_t serial = 0;
        std::uint32_t slot = 0;
        TimePoint deadline;
    };
    ChildProgram child_;
    FileHandle requests_, answers_;
    std::shared_ptr<const std::byte> memory_;
    std::deque<Asked> pending_;
    Duration workedAtLast_{};  ///< when something was pending last
    std::uint64_t lastSerial_ = 0;
    std::uint32_t nextSlot_ = 0;
    std::array<std::byte, sizeof(FilmAnswer)> part_{};
    std::size_t have_ = 0;  ///< of `part_`
};

}  // namespace tessera
