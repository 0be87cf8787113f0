/// The image a render host shows, in a file that other processes may look into at any instant.
///
/// A host keeps `tiles/TILE/shown.frame` mapped: a dead host's tile keeps its last image because the file outlives the
/// process, however that ended. Two slots: the next image is laid into the one that is not shown, then one word flips.
/// A slot counts its changes, odd while one is under way. A reader that is overtaken while it copies finds another
/// count afterwards and tries again: it never returns a torn image.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/FileHandle.h"
#include "common/image/Picture.h"

namespace tessera {

/// What a host shows, and which frame that is.
struct ShownImage {
    std::uint64_t frame = 0;
    Picture picture;
};

class SharedFrameFile;

/// A picture that lies whole in a shared frame file. A value, which one thread may hand to another.
class ReadyFrame {
public:
    /// Makes these the ones shown: all words first, then whoever waits for one is woken. Some nanoseconds each and a
    /// system call that waits for nothing; but the first in a file that takes the place of an earlier one waits for the
    /// file system. Any one thread; each at most once, after it was ready and before its writer begins another one.
    [[nodiscard]] static Expected<void> show(std::span<const ReadyFrame> frames);
    /// A copy. Until its writer begins the next but one, or the next if this is not shown.
    [[nodiscard]] Picture picture() const;
    /// A copy, `by` times smaller each way (Shrink.h). As long.
    [[nodiscard]] Picture shrunk(int by) const;

private:
    friend class SharedFrameWriter;
    ReadyFrame(std::shared_ptr<SharedFrameFile> file, int slot) : file_(std::move(file)), slot_(slot) {}

    std::shared_ptr<SharedFrameFile> file_;
    int slot_;
};

/// Draws into one shared frame file. One thread; one writer per file. The file of an earlier writer, and the image in
/// it, stay until the first picture of this one is shown.
class SharedFrameWriter {
public:
    /// Reserves room for pictures of exactly this size in a file beside `path`; makes missing folders.
    [[nodiscard]] static Expected<SharedFrameWriter> create(const std::string& path, int widthPx, int heightPx);

    /// Where the next picture is to be drawn, into the slot that is not shown: what was prepared is lost. Then
    /// `prepared`.
    [[nodiscard]] PixelRows begin();
    /// All its pixels are there, and it is the picture of this frame.
    void prepared(std::uint64_t frame);
    /// Both of it, from a picture.
    void prepare(std::uint64_t frame, const Picture& picture);
    /// The picture prepared last is that of this frame too. From its second time in a row on, that takes a few words.
    void prepareAgain(std::uint64_t frame);
    /// What was prepared last. There must be one.
    [[nodiscard]] ReadyFrame ready() const;
    /// Makes that the one shown.
    [[nodiscard]] Expected<void> show();

private:
    explicit SharedFrameWriter(std::shared_ptr<SharedFrameFile> file) : file_(std::move(file)) {}

    std::shared_ptr<SharedFrameFile> file_;
    int prepared_ = -1;                 ///< slot, or none
    int drawn_ = -1;                    ///< slot that `begin` has given out, or none
    bool holdsIt_[2] = {false, false};  ///< the slots where that lies
};

/// The image shown now. kNotFound: no host has shown anything there yet; kBadInput: not such a file; kFailed: the
/// writer was quicker than the reader many times over.
[[nodiscard]] Expected<ShownImage> readSharedFrame(const std::string& path);

/// Follows one shared frame file, picture by picture. One thread; any number of readers per file, each in any process.
class SharedFrameReader {
public:
    struct Frame {
        std::uint64_t number = 0;
        std::uint64_t times = 0;     ///< how many pictures had been shown in this file, this one included
        std::int64_t shownAtNs = 0;  ///< CLOCK_MONOTONIC of the machine: when its host made it the shown one
        int widthPx = 0, heightPx = 0;
        const std::uint8_t* rgbx = nullptr;  ///< rows from the top without gaps; until the next `read`
    };
    /// Errors as of `readSharedFrame`.
    [[nodiscard]] static Expected<SharedFrameReader> open(const std::string& path);
    ~SharedFrameReader();
    SharedFrameReader(SharedFrameReader&& other) noexcept;
    SharedFrameReader& operator=(SharedFrameReader&& other) noexcept;

    /// A whole copy of the picture shown now.
    [[nodiscard]] Expected<Frame> read();
    /// Which picture is shown now, without a copy of it: the next `read` may give a later one.
    struct Glance {
        std::uint64_t number = 0, times = 0;  ///< as in Frame
    };
    [[nodiscard]] Glance glance() const;
    /// Sleeps until another picture is shown than the one that was the `times`th, or the time is over: false.
    [[nodiscard]] bool waitForOther(std::uint64_t times, std::chrono::milliseconds atMost) const;
    /// Another writer's file has this name now: it is to be opened anew.
    [[nodiscard]] bool replaced() const;

private:
    SharedFrameReader() = default;
    std::string path_;
    FileHandle file_;
    void* header_ = nullptr;
    std::vector<std::uint8_t> rgbx_;
};

}  // namespace tessera
