/// Pictures of a film by their times, with ffmpeg's libraries.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "common/base/Error.h"

struct AVCodecContext;
struct AVFormatContext;
struct AVFrame;
struct AVPacket;
struct AVStream;

namespace tessera {

/// Reads a file from an open descriptor, which it may seek in and does not close; opens nothing else. One thread; not
/// confined by itself: whoever opens a stranger's film does so in a process of its own.
class FilmDecoder {
public:
    /// An error names what the film lacks, in words: no moving pictures, a format or codec that nobody knows.
    [[nodiscard]] static Expected<std::unique_ptr<FilmDecoder>> open(int descriptor);
    ~FilmDecoder();

    struct Shown {
        const AVFrame* frame = nullptr;  ///< until the next call
        double begin = 0, end = 0;       ///< s from the film's start
        bool wrapped = false;
    };
    /// The picture at a time: the last one that begins by then; before the first the first, after the last the last.
    /// Forwards it decodes what lies between, or begins at the nearest key picture; backwards at the one before. Fails
    /// where there is no picture at all, or none can be had any more.
    [[nodiscard]] Expected<Shown> at(double seconds);
    /// The one after the last that was told (after the last of the film: the first, of one that loops, else the last
    /// once more); where it ends by `seconds`, the picture of that time.
    [[nodiscard]] Expected<Shown> following(double seconds, bool loop);

    /// s: as the file says, until its end has been seen; 0: unknown.
    [[nodiscard]] double length() const { return length_; }
    /// How the picture is to be turned: x' = xx x + xy y, y' = yx x + yy y, each of 0, 1 and -1; y down.
    struct Orientation {
        int xx = 1, xy = 0, yx = 0, yy = 1;
        [[nodiscard]] bool upright() const { return xx == 1 && yy == 1; }
    };
    [[nodiscard]] Orientation orientation() const { return orientation_; }

private:
    struct Timed {
        AVFrame* frame = nullptr;
        double begin = 0, length = 0;
        bool there = false;
    };
    struct Input;

    FilmDecoder();
    [[nodiscard]] Expected<void> openFile();
    [[nodiscard]] Expected<void> openCodec();
    void closeFile();
    /// From the start, or from the key picture before a time.
    [[nodiscard]] Expected<void> wind(double seconds);
    [[nodiscard]] Expected<void> decode(Timed& into);
    [[nodiscard]] Expected<void> step();
    void time(Timed& timed);
    [[nodiscard]] double endOfCurrent() const;
    [[nodiscard]] std::int64_t ticksAt(double seconds) const;
    [[nodiscard]] Shown shown(bool wrapped = false) const;
    [[nodiscard]] bool keyPictureAhead(double seconds) const;

    std::unique_ptr<Input> input_;
    AVFormatContext* format_ = nullptr;
    AVCodecContext* codec_ = nullptr;
    AVStream* stream_ = nullptr;
    AVPacket* packet_ = nullptr;
    Timed current_, next_;  ///< the one that is shown, and the one after it, which says when it ends
    double secondsPerTick_ = 0, start_ = 0, usual_ = 0.04, length_ = 0;
    double last_ = -1;             ///< begin of what was decoded last; below 0: nothing since the file was wound
    std::optional<double> first_;  ///< begin of the first picture; none: the file has not been opened
    bool fromStart_ = true, draining_ = false, ended_ = false;
    Orientation orientation_;
};

}  // namespace tessera
