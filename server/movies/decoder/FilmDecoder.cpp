#include "server/movies/decoder/FilmDecoder.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
}
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

namespace tessera {
namespace {

constexpr int kReadBytes = 65536;
constexpr std::int64_t kMostDecodedPixels = std::int64_t{16384} * 16384;
/// Of packets that bring no picture, one after the other: a film that goes on like this has none.
constexpr int kMostFruitless = 100'000;
constexpr double kMostSeconds = 1e9;

std::string wordsOf(int error) {
    char text[AV_ERROR_MAX_STRING_SIZE] = {};
    av_strerror(error, text, sizeof text);
    return text;
}

int readPart(void* opaque, std::uint8_t* into, int size) {
    const int descriptor = *static_cast<int*>(opaque);
    for (;;) {
        const ssize_t got = ::read(descriptor, into, static_cast<std::size_t>(size));
        if (got > 0) return static_cast<int>(got);
        if (got == 0) return AVERROR_EOF;
        if (errno != EINTR) return AVERROR(errno);
    }
}

std::int64_t seekTo(void* opaque, std::int64_t offset, int whence) {
    const int descriptor = *static_cast<int*>(opaque);
    if (whence & AVSEEK_SIZE) {
        const off_t here = ::lseek(descriptor, 0, SEEK_CUR), end = ::lseek(descriptor, 0, SEEK_END);
        ::lseek(descriptor, here, SEEK_SET);
        return end;
    }
    const off_t there = ::lseek(descriptor, offset, whence & ~AVSEEK_FORCE);
    return there < 0 ? AVERROR(errno) : there;
}

/// What lists of films begin with: HLS, ffmpeg's own, PLS, DASH, ASX, SMIL.
bool isPlaylist(int descriptor) {
    char head[1024] = {};
    const ssize_t got = ::pread(descriptor, head, sizeof head, 0);
    std::string_view text(head, static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    for (const std::string_view beginning :
         {"#EXTM3U", "ffconcat version", "[playlist]", "<asx", "<ASX", "<smil", "<SMIL"})
        if (text.starts_with(beginning)) return true;
    return text.starts_with("<") && text.find("<MPD") != std::string_view::npos;
}

/// Playlists name other files: nobody opens them.
int openNothing(AVFormatContext*, AVIOContext**, const char*, int, AVDictionary**) {
    return AVERROR(EPERM);
}

/// Of quarter turns and mirrors; other matrices leave the picture as it is.
FilmDecoder::Orientation orientationOf(const AVStream& stream) {
    std::size_t size = 0;
    const std::uint8_t* bytes = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, &size);
    if (!bytes || size < 9 * sizeof(std::int32_t)) return {};
    std::int32_t matrix[9];
    std::memcpy(matrix, bytes, sizeof matrix);
    const double scale = std::max({std::abs(double(matrix[0])), std::abs(double(matrix[1])), 1.0});
    const auto whole = [&](std::int32_t number) {
        return static_cast<int>(std::lround(std::clamp(number / scale, -2.0, 2.0)));
    };
    // (x, y) is led to (a x + c y, b x + d y).
    const FilmDecoder::Orientation said{
        .xx = whole(matrix[0]), .xy = whole(matrix[3]), .yx = whole(matrix[1]), .yy = whole(matrix[4])};
    const bool straight = std::abs(said.xx) == 1 && said.xy == 0 && said.yx == 0 && std::abs(said.yy) == 1;
    const bool quarter = said.xx == 0 && std::abs(said.xy) == 1 && std::abs(said.yx) == 1 && said.yy == 0;
    return straight || quarter ? said : FilmDecoder::Orientation();
}

}  // namespace

struct FilmDecoder::Input {
    int descriptor = -1;
    AVIOContext* context = nullptr;
};

FilmDecoder::FilmDecoder() : input_(std::make_unique<Input>()), packet_(av_packet_alloc()) {
    current_.frame = av_frame_alloc();
    next_.frame = av_frame_alloc();
}

FilmDecoder::~FilmDecoder() {
    closeFile();
    av_packet_free(&packet_);
    av_frame_free(&current_.frame);
    av_frame_free(&next_.frame);
}

void FilmDecoder::closeFile() {
    avcodec_free_context(&codec_);
    avformat_close_input(&format_);
    if (input_->context) av_freep(&input_->context->buffer);
    avio_context_free(&input_->context);
    stream_ = nullptr;
}

Expected<std::unique_ptr<FilmDecoder>> FilmDecoder::open(int descriptor) {
    av_log_set_level(AV_LOG_QUIET);
    std::unique_ptr<FilmDecoder> decoder(new FilmDecoder);
    decoder->input_->descriptor = descriptor;
    if (Expected<Shown> first = decoder->at(0); !first) return tl::unexpected(first.error());
    return decoder;
}

Expected<void> FilmDecoder::openFile() {
    closeFile();
    if (::lseek(input_->descriptor, 0, SEEK_SET) != 0)
        return fail(ErrorCode::kBadInput, "it is no file that can be wound back");
    if (isPlaylist(input_->descriptor))
        return fail(ErrorCode::kUnsupported, "it is a playlist, which names films, and no film itself");
    input_->context = avio_alloc_context(static_cast<unsigned char*>(av_malloc(kReadBytes)), kReadBytes, 0,
                                         &input_->descriptor, &readPart, nullptr, &seekTo);
    format_ = avformat_alloc_context();
    format_->pb = input_->context;
    format_->flags |= AVFMT_FLAG_CUSTOM_IO;
    format_->io_open = &openNothing;
    if (const int error = avformat_open_input(&format_, nullptr, nullptr, nullptr); error < 0)
        return fail(ErrorCode::kBadInput, fmt::format("it is no film, or damaged ({})", wordsOf(error)));
    if (const int error = avformat_find_stream_info(format_, nullptr); error < 0)
        return fail(ErrorCode::kBadInput, fmt::format("what is in it cannot be found out ({})", wordsOf(error)));
    const int number = av_find_best_stream(format_, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
    if (number < 0 || (format_->streams[number]->disposition & AV_DISPOSITION_ATTACHED_PIC) != 0) {
        const bool sound = av_find_best_stream(format_, AVMEDIA_TYPE_AUDIO, -1, -1, nullptr, 0) >= 0;
        return fail(ErrorCode::kBadInput, sound ? "it has sound and no moving pictures" : "it has no moving pictures");
    }
    stream_ = format_->streams[number];
    for (unsigned i = 0; i < format_->nb_streams; ++i)
        if (static_cast<int>(i) != number) format_->streams[i]->discard = AVDISCARD_ALL;
    return openCodec();
}

Expected<void> FilmDecoder::openCodec() {
    const AVCodecParameters& said = *stream_->codecpar;
    const AVCodec* codec = avcodec_find_decoder(said.codec_id);
    // ffmpeg's own decoders of VP8 and VP9 leave out what lets through.
    const AVDictionaryEntry* alpha = av_dict_get(stream_->metadata, "alpha_mode", nullptr, 0);
    if (alpha && std::strcmp(alpha->value, "1") == 0)
        if (const AVCodec* other =
                avcodec_find_decoder_by_name(said.codec_id == AV_CODEC_ID_VP9 ? "libvpx-vp9" : "libvpx");
            other && other->id == said.codec_id)
            codec = other;
    if (!codec)
        return fail(ErrorCode::kUnsupported,
                    fmt::format("its codec ({}) is none that can be decoded here", avcodec_get_name(said.codec_id)));
    codec_ = avcodec_alloc_context3(codec);
    codec_->max_pixels = kMostDecodedPixels;
    codec_->thread_count = 1;  // a confined process makes no threads
    codec_->pkt_timebase = stream_->time_base;
    int error = avcodec_parameters_to_context(codec_, &said);
    if (error >= 0) error = avcodec_open2(codec_, codec, nullptr);
    if (error < 0)
        return fail(ErrorCode::kBadInput, fmt::format("its pictures ({}) cannot be decoded ({})",
                                                      avcodec_get_name(said.codec_id), wordsOf(error)));
    secondsPerTick_ = av_q2d(stream_->time_base);
    if (!(secondsPerTick_ > 0 && secondsPerTick_ < 1e6)) return fail(ErrorCode::kBadInput, "its clock has no unit");
    const double rate = stream_->avg_frame_rate.den != 0 ? av_q2d(stream_->avg_frame_rate) : 0;
    usual_ = rate > 1e-3 && rate < 1e6 ? 1 / rate : 0.04;
    start_ = stream_->start_time != AV_NOPTS_VALUE ? static_cast<double>(stream_->start_time) * secondsPerTick_ : 0;
    if (!(std::abs(start_) < kMostSeconds)) return fail(ErrorCode::kBadInput, "its first time is nonsense");
    if (length_ <= 0) {
        // A guess by the rate of bits is none.
        const bool counted = format_->duration_estimation_method != AVFMT_DURATION_FROM_BITRATE;
        if (stream_->duration > 0 && stream_->duration != AV_NOPTS_VALUE)
            length_ = static_cast<double>(stream_->duration) * secondsPerTick_;
        else if (counted && format_->duration > 0 && format_->duration != AV_NOPTS_VALUE)
            length_ = static_cast<double>(format_->duration) / AV_TIME_BASE;
        if (!(length_ < kMostSeconds)) length_ = 0;
    }
    orientation_ = orientationOf(*stream_);
    current_.there = next_.there = draining_ = ended_ = false;
    fromStart_ = true;
    last_ = -1;
    return {};
}

/// Of what has just been decoded.
void FilmDecoder::time(Timed& timed) {
    const std::int64_t ticks = timed.frame->best_effort_timestamp;
    const double said = static_cast<double>(ticks) * secondsPerTick_ - start_;
    timed.begin = ticks != AV_NOPTS_VALUE && std::abs(said) < kMostSeconds ? said : last_ < 0 ? 0 : last_ + usual_;
    // Times that stand or run backwards within a film are nobody's.
    if (last_ >= 0 && !(timed.begin > last_)) timed.begin = last_ + 1e-6;
    timed.begin = std::max(timed.begin, 0.0);
    last_ = timed.begin;
    const double length = static_cast<double>(timed.frame->pkt_duration) * secondsPerTick_;
    timed.length = length > 0 && length < 1e6 ? length : usual_;
}

/// `into.there` is false where the film has come to its end.
Expected<void> FilmDecoder::decode(Timed& into) {
    into.there = false;
    for (int fruitless = 0; !ended_; ++fruitless) {
        if (fruitless > kMostFruitless)
            return fail(ErrorCode::kBadInput, "much of it follows in which there is no picture");
        const int got = avcodec_receive_frame(codec_, into.frame);
        if (got >= 0) {
            // Amid a film, a picture that says no time could be any.
            if (into.frame->best_effort_timestamp == AV_NOPTS_VALUE && last_ < 0 && !fromStart_) continue;
            time(into);
            into.there = true;
            return {};
        }
        if (got == AVERROR_EOF) {
            ended_ = true;
            break;
        }
        if (got != AVERROR(EAGAIN)) continue;  // one damaged picture
        if (draining_) {
            ended_ = true;
            break;
        }
        const int read = av_read_frame(format_, packet_);
        if (read == AVERROR(EAGAIN)) continue;
        if (read < 0) {
            // The end, or what cannot be read any more, which is one.
            draining_ = true;
            (void)avcodec_send_packet(codec_, nullptr);
            continue;
        }
        if (packet_->stream_index == stream_->index)
            (void)avcodec_send_packet(codec_, packet_);  // what is damaged brings no picture
        av_packet_unref(packet_);
    }
    return {};
}

double FilmDecoder::endOfCurrent() const {
    return next_.there ? next_.begin : current_.begin + current_.length;
}

FilmDecoder::Shown FilmDecoder::shown(bool wrapped) const {
    return {.frame = current_.frame, .begin = current_.begin, .end = endOfCurrent(), .wrapped = wrapped};
}

/// One picture on; `next_` is there.
Expected<void> FilmDecoder::step() {
    std::swap(current_, next_);
    if (Expected<void> decoded = decode(next_); !decoded) return decoded;
    if (!next_.there) length_ = endOfCurrent();
    return {};
}

std::int64_t FilmDecoder::ticksAt(double seconds) const {
    return static_cast<std::int64_t>(std::llround(std::clamp((seconds + start_) / secondsPerTick_, -9e18, 9e18)));
}

/// Leaves `current_` and `next_` at the first pictures from there on.
Expected<void> FilmDecoder::wind(double seconds) {
    current_.there = next_.there = false;
    if (first_ && av_seek_frame(format_, stream_->index, ticksAt(seconds), AVSEEK_FLAG_BACKWARD) >= 0) {
        avcodec_flush_buffers(codec_);
        draining_ = ended_ = fromStart_ = false;
        last_ = -1;
        if (Expected<void> decoded = decode(current_); !decoded) return decoded;
    }
    // What cannot be wound, or not to its start, is opened anew.
    if (!current_.there || (seconds <= 0 && current_.begin > *first_)) {
        if (Expected<void> opened = openFile(); !opened) return opened;
        if (Expected<void> decoded = decode(current_); !decoded) return decoded;
        if (!current_.there) return {};
        first_ = current_.begin;
    }
    if (Expected<void> decoded = decode(next_); !decoded) return decoded;
    if (!next_.there) length_ = endOfCurrent();
    return {};
}

/// Whether a key picture lies between what is shown and a time: what lies before it need not be decoded.
bool FilmDecoder::keyPictureAhead(double seconds) const {
    if (seconds < endOfCurrent() + 1) return false;
    const int entry = av_index_search_timestamp(stream_, ticksAt(seconds), AVSEEK_FLAG_BACKWARD);
    if (entry < 0) return seconds > endOfCurrent() + 10;
    const AVIndexEntry* key = avformat_index_get_entry(stream_, entry);
    return key && key->timestamp > ticksAt(next_.there ? next_.begin : current_.begin);
}

Expected<FilmDecoder::Shown> FilmDecoder::at(double seconds) {
    seconds = std::clamp(seconds, 0.0, kMostSeconds);
    // At the film's end nothing lies ahead, whatever its index says.
    const bool atEnd = current_.there && !next_.there;
    if (!current_.there || seconds < current_.begin || (!atEnd && keyPictureAhead(seconds))) {
        // Where a key picture's time is not the first that comes after it, further back.
        double from = seconds;
        for (double back = 1;; back *= 4) {
            if (Expected<void> wound = wind(from); !wound) return tl::unexpected(wound.error());
            if ((current_.there && current_.begin <= seconds) || from <= 0) break;
            from = back > 1000 ? 0 : std::max(0.0, seconds - back);
        }
        if (!current_.there) return fail(ErrorCode::kBadInput, "no picture can be decoded in it");
    }
    while (next_.there && next_.begin <= seconds)
        if (Expected<void> stepped = step(); !stepped) return tl::unexpected(stepped.error());
    return shown();
}

Expected<FilmDecoder::Shown> FilmDecoder::following(double seconds, bool loop) {
    if (!current_.there) return at(seconds);
    if (!next_.there) {
        if (!loop) return shown();
        if (Expected<void> wound = wind(0); !wound) return tl::unexpected(wound.error());
        if (!current_.there) return fail(ErrorCode::kBadInput, "no picture can be decoded in it any more");
        return shown(true);
    }
    if (Expected<void> stepped = step(); !stepped) return tl::unexpected(stepped.error());
    return endOfCurrent() <= seconds ? at(seconds) : shown();
}

}  // namespace tessera
