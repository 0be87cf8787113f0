#include "tests/unit/movies/NumberedFilm.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <array>
#include <cstdlib>
#include <cstring>

namespace tessera::test {
namespace {

constexpr std::array<int, 4> kGrey = {0, 85, 170, 255};

bool drain(AVFormatContext* file, AVCodecContext* codec, AVStream* stream, AVPacket* packet) {
    for (;;) {
        const int got = avcodec_receive_packet(codec, packet);
        if (got == AVERROR(EAGAIN) || got == AVERROR_EOF) return true;
        if (got < 0) return false;
        av_packet_rescale_ts(packet, codec->time_base, stream->time_base);
        packet->stream_index = stream->index;
        if (av_interleaved_write_frame(file, packet) < 0) return false;
    }
}

bool writePictures(AVFormatContext* file, AVStream* stream, AVCodecContext* codec, const FilmRecipe& recipe) {
    AVFrame* frame = av_frame_alloc();
    frame->format = codec->pix_fmt;
    frame->width = codec->width;
    frame->height = codec->height;
    av_frame_get_buffer(frame, 0);
    SwsContext* scaler =
        sws_getContext(codec->width, codec->height, AV_PIX_FMT_RGBA, codec->width, codec->height, codec->pix_fmt,
                       SWS_BILINEAR | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INP, nullptr, nullptr, nullptr);
    AVPacket* packet = av_packet_alloc();
    bool good = scaler != nullptr;
    for (int i = 0; good && i < recipe.pictures; ++i) {
        const std::vector<std::uint8_t> pixels = numberedPixels(i, codec->width, codec->height, recipe.alpha);
        av_frame_make_writable(frame);
        const std::uint8_t* const from[4] = {pixels.data(), nullptr, nullptr, nullptr};
        const int stride[4] = {4 * codec->width, 0, 0, 0};
        sws_scale(scaler, from, stride, 0, codec->height, frame->data, frame->linesize);
        frame->pts = recipe.times.empty() ? 40 * i : recipe.times[static_cast<std::size_t>(i)];
        good = avcodec_send_frame(codec, frame) >= 0 && drain(file, codec, stream, packet);
    }
    good = good && avcodec_send_frame(codec, nullptr) >= 0 && drain(file, codec, stream, packet);
    av_packet_free(&packet);
    av_frame_free(&frame);
    sws_freeContext(scaler);
    return good;
}

/// A second of silence.
bool writeSound(AVFormatContext* file, AVStream* stream) {
    std::vector<std::uint8_t> silence(2 * 8000);
    AVPacket* packet = av_packet_alloc();
    bool good = av_new_packet(packet, static_cast<int>(silence.size())) >= 0;
    std::memcpy(packet->data, silence.data(), silence.size());
    packet->stream_index = stream->index;
    packet->pts = packet->dts = 0;
    packet->duration = stream->time_base.den / stream->time_base.num;
    good = good && av_interleaved_write_frame(file, packet) >= 0;
    av_packet_free(&packet);
    return good;
}

}  // namespace

std::vector<std::uint8_t> numberedPixels(int number, int width, int height, int alpha) {
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            std::uint8_t* p =
                pixels.data() +
                (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * 4;
            const int column = std::min(3, 4 * x / width);
            const auto grey =
                static_cast<std::uint8_t>(kGrey[static_cast<std::size_t>(number >> (2 * (3 - column)) & 3)]);
            const bool red = 2 * y >= height && column == 0;
            p[0] = red ? 255 : grey;
            p[1] = p[2] = red ? 0 : grey;
            p[3] = static_cast<std::uint8_t>(2 * x < width ? 255 : alpha);
        }
    return pixels;
}

int numberIn(std::span<const std::uint8_t> rgba, int width, int height) {
    if (rgba.size() < static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4) return -1;
    int number = 0;
    for (int column = 0; column < 4; ++column) {
        const int x = (2 * column + 1) * width / 8, y = height / 4;
        const std::uint8_t* p =
            rgba.data() +
            (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * 4;
        const int bits = (p[1] + 42) / 85;
        // Codecs lose a little; half of a step would be another number.
        if (std::abs(p[1] - kGrey[static_cast<std::size_t>(std::min(bits, 3))]) > 30 || std::abs(p[0] - p[1]) > 30)
            return -1;
        number = number << 2 | std::min(bits, 3);
    }
    return number;
}

bool makeFilm(const std::string& path, const FilmRecipe& recipe) {
    av_log_set_level(AV_LOG_QUIET);
    AVFormatContext* file = nullptr;
    if (avformat_alloc_output_context2(&file, nullptr, nullptr, path.c_str()) < 0) return false;
    const AVCodec* encoder = recipe.codec.empty() ? nullptr : avcodec_find_encoder_by_name(recipe.codec.c_str());
    AVCodecContext* codec = nullptr;
    AVStream *pictures = nullptr, *sound = nullptr;
    bool good = recipe.codec.empty() || encoder;
    if (encoder) {
        codec = avcodec_alloc_context3(encoder);
        codec->width = recipe.widthPx;
        codec->height = recipe.heightPx;
        codec->pix_fmt = av_get_pix_fmt(recipe.pixels.c_str());
        codec->time_base = {1, 1000};
        if (path.ends_with(".avi") || recipe.codec == "mpeg4" || recipe.codec == "mpeg2video")
            codec->time_base = {1, 25};
        codec->framerate = {25, 1};
        codec->gop_size = recipe.keyEvery;
        codec->global_quality = 2 * FF_QP2LAMBDA;
        codec->flags |= AV_CODEC_FLAG_QSCALE;
        codec->thread_count = 1;
        codec->strict_std_compliance = FF_COMPLIANCE_EXPERIMENTAL;
        if (file->oformat->flags & AVFMT_GLOBALHEADER) codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
        good = good && avcodec_open2(codec, encoder, nullptr) >= 0;
        pictures = avformat_new_stream(file, nullptr);
        pictures->time_base = codec->time_base;
        pictures->avg_frame_rate = {25, 1};
        good = good && avcodec_parameters_from_context(pictures->codecpar, codec) >= 0;
        if (recipe.turnedDeg != 0) {
            auto* matrix = reinterpret_cast<std::int32_t*>(
                av_stream_new_side_data(pictures, AV_PKT_DATA_DISPLAYMATRIX, 9 * sizeof(std::int32_t)));
            av_display_rotation_set(matrix, recipe.turnedDeg);
        }
    }
    if (recipe.sound) {
        sound = avformat_new_stream(file, nullptr);
        sound->codecpar->codec_type = AVMEDIA_TYPE_AUDIO;
        sound->codecpar->codec_id = AV_CODEC_ID_PCM_S16LE;
        sound->codecpar->sample_rate = 8000;
        sound->codecpar->format = AV_SAMPLE_FMT_S16;
        sound->codecpar->bits_per_coded_sample = 16;
        sound->codecpar->bit_rate = 128000;
        sound->codecpar->block_align = 2;
        av_channel_layout_default(&sound->codecpar->ch_layout, 1);
        sound->time_base = {1, 8000};
    }
    good =
        good && avio_open(&file->pb, path.c_str(), AVIO_FLAG_WRITE) >= 0 && avformat_write_header(file, nullptr) >= 0;
    if (good && sound) good = writeSound(file, sound);
    // The encoder's unit of time is what `writePictures` counts in, but for codecs that know 25 a second alone.
    FilmRecipe steps = recipe;
    if (codec && codec->time_base.den == 25)
        for (int i = 0; i < recipe.pictures; ++i) steps.times.resize(static_cast<std::size_t>(i + 1), i);
    if (good && codec) good = writePictures(file, pictures, codec, steps);
    good = good && av_write_trailer(file) >= 0;
    avcodec_free_context(&codec);
    if (file->pb) avio_closep(&file->pb);
    avformat_free_context(file);
    return good;
}

}  // namespace tessera::test
