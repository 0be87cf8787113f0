#include "client/ctl/PlayTracker.h"

#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <thread>

#include <fmt/format.h>

#include "common/base/Clock.h"

namespace tessera {

namespace {

void putWord(Bytes& bytes, std::uint32_t word) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::byte>(word >> shift & 0xff));
}
void putText(Bytes& bytes, const std::string& text) {
    for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
    do bytes.push_back(std::byte{0});
    while (bytes.size() % 4 != 0);
}

/// A datagram socket that knows where to send.
class TrackerSender {
public:
    ~TrackerSender() {
        if (fd_ >= 0) close(fd_);
    }
    Expected<void> open(const std::string& to) {
        const std::size_t colon = to.rfind(':');
        if (colon == std::string::npos || colon + 1 == to.size())
            return fail(
                ErrorCode::kUsage,
                fmt::format("play-tracker: \"{}\" is no address; write HOST:PORT, where the wall's tracker listens",
                            to));
        std::string host = to.substr(0, colon);
        if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
        addrinfo hints{}, *found = nullptr;
        hints.ai_socktype = SOCK_DGRAM;
        std::uint16_t port = 0;
        const char* const end = to.data() + to.size();
        if (const auto [stop, error] = std::from_chars(to.data() + colon + 1, end, port);
            error != std::errc() || stop != end || port == 0)
            return fail(ErrorCode::kUsage,
                        fmt::format("play-tracker: \"{}\": its port is not a number from 1 to 65535", to));
        if (const int error = getaddrinfo(host.c_str(), to.c_str() + colon + 1, &hints, &found); error != 0)
            return fail(ErrorCode::kNetwork, fmt::format("play-tracker: {}: {}", to, gai_strerror(error)));
        fd_ = socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        const bool reached = fd_ >= 0 && connect(fd_, found->ai_addr, found->ai_addrlen) == 0;
        freeaddrinfo(found);
        if (!reached) return fail(ErrorCode::kNetwork, fmt::format("play-tracker: {} cannot be reached from here", to));
        return {};
    }
    /// False: nobody listens there, as far as the network says.
    bool send(const Bytes& bytes) const { return ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) >= 0; }

private:
    int fd_ = -1;
};

}  // namespace

PlayedPose circlePose(double time) {
    const double angle = 2 * std::numbers::pi * time / 4;
    return {.time = time, .position = Vec3d(0.3 * std::cos(angle), 1.7 + 0.3 * std::sin(angle), 2)};
}

Expected<std::vector<PlayedPose>> readTrackerPoses(const std::string& path) {
    std::ifstream file(path);
    if (!file) return fail(ErrorCode::kNotFound, fmt::format("{}: cannot be read", path));
    std::vector<PlayedPose> poses;
    std::string line;
    constexpr std::size_t kMostPoses = 1'000'000;
    for (std::size_t number = 1; std::getline(file, line); ++number) {
        if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
        line = line.substr(0, line.find('#'));
        std::istringstream in(line);
        in.imbue(std::locale::classic());
        std::vector<double> values;
        for (double value = 0; in >> value;) values.push_back(value);
        const auto refuse = [&](std::string_view why) {
            return fail(ErrorCode::kBadInput, fmt::format("{}:{}: {}", path, number, why));
        };
        if (!in.eof()) return refuse("something that is no number");
        if (values.empty()) continue;
        if (values.size() != 4 && values.size() != 8)
            return refuse("a line has 4 numbers, TIME X Y Z, or 8, with QW QX QY QZ");
        if (!std::ranges::all_of(values, [](double v) { return std::isfinite(v); }))
            return refuse("a number that is not finite");
        PlayedPose pose{.time = values[0], .position = {values[1], values[2], values[3]}};
        if (values.size() == 8) pose.orientation = Quatd(values[4], values[5], values[6], values[7]);
        if (!tellsRotation(pose.orientation.squaredNorm()))
            return refuse("a quaternion whose length is 0, or nearly, or beyond what numbers can hold");
        pose.orientation.normalize();
        if (!poses.empty() && pose.time <= poses.back().time)
            return refuse("its time is not after that of the line before");
        if (poses.size() == kMostPoses) return refuse("more than a million poses");
        poses.push_back(pose);
    }
    if (poses.empty()) return fail(ErrorCode::kBadInput, fmt::format("{}: no pose in it", path));
    return poses;
}

PlayedPose poseAt(const std::vector<PlayedPose>& poses, double time) {
    const double first = poses.front().time, length = poses.back().time - first;
    const double at = length > 0 ? first + std::fmod(time, length) : first;
    const auto next = std::ranges::upper_bound(poses, at, {}, &PlayedPose::time);
    if (next == poses.begin()) return poses.front();
    if (next == poses.end()) return poses.back();
    const PlayedPose& before = *std::prev(next);
    const double share = (at - before.time) / (next->time - before.time);
    return {.time = at,
            .position = before.position + share * (next->position - before.position),
            .orientation = before.orientation.slerp(share, next->orientation)};
}

Bytes dtrackDatagram(std::uint64_t frame, int sensor, bool flystick, std::uint32_t buttons, const PlayedPose& pose) {
    const Mat3d r = pose.orientation.toRotationMatrix();
    const Vec3d mm = 1000 * pose.position;
    const std::string place = fmt::format("[{:.3f} {:.3f} {:.3f}", mm.x(), mm.y(), mm.z());
    std::string matrix;
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row) matrix += fmt::format("{}{:.6f}", matrix.empty() ? "[" : " ", r(row, column));
    const std::string text =
        flystick
            ? fmt::format("fr {}\r\n6df2 1 1 [{} 1.000 8 0]{}]{}][{}]\r\n", frame, sensor, place, matrix, buttons)
            : fmt::format("fr {}\r\n6dcal 1\r\n6d 1 [{} 1.000]{} 0.0 0.0 0.0]{}]\r\n", frame, sensor, place, matrix);
    const ByteSpan bytes = asBytes(text);
    return {bytes.begin(), bytes.end()};
}

Bytes oscDatagram(int sensor, const PlayedPose& pose) {
    Bytes bytes;
    putText(bytes, fmt::format("/tessera/{}/pose", sensor));
    putText(bytes, ",fffffff");
    const Quatd& q = pose.orientation;
    for (const double value : {pose.position.x(), pose.position.y(), pose.position.z(), q.x(), q.y(), q.z(), q.w()})
        putWord(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
    return bytes;
}

Expected<Answer> play(const verb::PlayTracker& wish) {
    std::vector<PlayedPose> poses;
    if (!wish.file.empty()) {
        Expected<std::vector<PlayedPose>> read = readTrackerPoses(wish.file);
        if (!read) return tl::unexpected(read.error());
        poses = std::move(*read);
    }
    TrackerSender sender;
    if (Expected<void> opened = sender.open(wish.to); !opened) return tl::unexpected(opened.error());
    const TimePoint start = clockNow();
    std::uint64_t sent = 0, refused = 0;
    for (;; ++sent) {
        const double time = static_cast<double>(sent) / wish.rateHz;
        if (wish.seconds > 0 && time >= wish.seconds) break;
        std::this_thread::sleep_until(start +
                                      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(time)));
        const PlayedPose pose = poses.empty() ? circlePose(time) : poseAt(poses, time);
        if (!sender.send(wish.osc ? oscDatagram(wish.sensor, pose)
                                  : dtrackDatagram(sent, wish.sensor, wish.flystick, wish.buttons, pose)))
            ++refused;
    }
    Answer answer{fmt::format("sent {} poses to {}\n", sent, wish.to), {{"sent", sent}, {"refused", refused}}, {}};
    if (refused > 0) answer.warning = fmt::format("{} of them found nobody there", refused);
    return answer;
}

}  // namespace tessera
