#include "server/movies/FilmProcess.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <memory>
#include <utility>

#include "common/cores/Image.h"
#include "common/drawable/ImageLayout.h"

namespace tessera {
namespace {

Error noDecoder(std::string_view step) {
    return {ErrorCode::kFailed, fmt::format("films cannot be decoded: {} ({})", step, std::strerror(errno))};
}

}  // namespace

Expected<FilmProcess> FilmProcess::start(FileHandle film, const std::string& program) {
    // Its size is sealed: a child that shrinks it would take the server with it.
    const FileHandle memory(::memfd_create("film", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    constexpr std::size_t kBytes = kFilmSlots * kFilmSlotBytes;
    if (memory.get() < 0 || ::ftruncate(memory.get(), static_cast<off_t>(kBytes)) != 0 ||
        ::fcntl(memory.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
        return tl::unexpected(noDecoder("no memory for pictures"));
    void* const mapped = ::mmap(nullptr, kBytes, PROT_READ, MAP_SHARED, memory.get(), 0);
    if (mapped == MAP_FAILED) return tl::unexpected(noDecoder("no memory for pictures"));
    FilmProcess process;
    process.memory_ = {static_cast<const std::byte*>(mapped),
                       [](const std::byte* all) { ::munmap(const_cast<std::byte*>(all), kBytes); }};

    std::array<int, 2> up{}, down{};
    if (::pipe2(up.data(), O_CLOEXEC) != 0) return tl::unexpected(noDecoder("pipe"));
    process.answers_ = FileHandle(up[0]);
    const FileHandle answersOut(up[1]);
    // A socket, as a child that has gone must not end who asks it (SIGPIPE).
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, down.data()) != 0)
        return tl::unexpected(noDecoder("socketpair"));
    const FileHandle requestsIn(down[0]);
    process.requests_ = FileHandle(down[1]);
    ::fcntl(requestsIn.get(), F_SETFL, 0);
    ::fcntl(process.answers_.get(), F_SETFL, O_NONBLOCK);
    Expected<ChildProgram> child =
        ChildProgram::start({.path = program.empty() ? pathBesideThisProgram("tessera-decode-film") : program,
                             .arguments = {"--parent", std::to_string(::getpid())},
                             .environment = {},
                             .files = {{film.get(), 0},
                                       {answersOut.get(), 1},
                                       {requestsIn.get(), kFilmRequestsFd},
                                       {memory.get(), kFilmMemoryFd}}});
    if (!child) return fail(child.error().code, "films cannot be decoded: " + child.error().message);
    process.child_ = std::move(*child);
    return process;
}

std::uint64_t FilmProcess::ask(FilmRequest request, TimePoint now) {
    request.slot = nextSlot_;
    request.serial = ++lastSerial_;
    nextSlot_ = static_cast<std::uint32_t>((nextSlot_ + 1) % kFilmSlots);
    // There is room for all that may be under way; where the child has gone, `poll` says so.
    (void)::send(requests_.get(), &request, sizeof request, MSG_NOSIGNAL | MSG_DONTWAIT);
    pending_.push_back({request.serial, request.slot, now + std::chrono::seconds(kSeconds)});
    return request.serial;
}

Expected<std::vector<FilmFrame>> FilmProcess::poll(TimePoint now, Duration patience) {
    const auto ms = static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(patience).count());
    const auto comes = [&] {
        pollfd waiting{answers_.get(), POLLIN, 0};
        return ms > 0 && !pending_.empty() && ::poll(&waiting, 1, ms) > 0;
    };
    std::vector<FilmFrame> frames;
    for (;;) {
        const ssize_t got = ::read(answers_.get(), part_.data() + have_, part_.size() - have_);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
            if (comes()) continue;
            break;
        }
        if (got <= 0) return tl::unexpected(ended());
        have_ += static_cast<std::size_t>(got);
        if (have_ < part_.size()) continue;
        have_ = 0;
        FilmAnswer answer;
        std::memcpy(&answer, part_.data(), sizeof answer);
        Expected<FilmFrame> frame = take(answer);
        if (!frame) {
            (void)child_.kill();
            return tl::unexpected(frame.error());
        }
        frames.push_back(std::move(*frame));
    }
    // It renews its own limit for each picture, so that limit alone does not bind whoever has taken it over.
    if (!pending_.empty())
        workedAtLast_ = worked();
    else if (worked() > workedAtLast_ + std::chrono::seconds(kIdleSeconds)) {
        (void)child_.kill();
        return fail(ErrorCode::kBadInput, "who decodes it works though nothing is asked of it");
    }
    if (!pending_.empty() && now > pending_.front().deadline) {
        (void)child_.kill();
        return fail(ErrorCode::kLimit, fmt::format("a picture of it takes longer than {} s", kSeconds));
    }
    return frames;
}

Duration FilmProcess::worked() const {
    clockid_t clock{};
    timespec spent{};
    if (::clock_getcpuclockid(child_.pid(), &clock) != 0 || ::clock_gettime(clock, &spent) != 0) return {};
    return std::chrono::seconds(spent.tv_sec) + std::chrono::nanoseconds(spent.tv_nsec);
}

Expected<FilmFrame> FilmProcess::take(const FilmAnswer& answer) {
    const auto nonsense = fail(ErrorCode::kBadInput, "who decodes it says nonsense");
    if (answer.magic != FilmAnswer::kMagic) return nonsense;
    if (answer.kind == FilmAnswer::Kind::kTrouble) {
        std::string text(answer.text.data(), ::strnlen(answer.text.data(), answer.text.size()));
        // A stranger's words go to a terminal.
        for (char& c : text)
            if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = ' ';
        return fail(ErrorCode::kBadInput, text.empty() ? "it cannot be decoded" : std::move(text));
    }
    if (answer.kind != FilmAnswer::Kind::kPicture || pending_.empty() || answer.serial != pending_.front().serial ||
        answer.slot != pending_.front().slot)
        return nonsense;
    pending_.pop_front();
    const auto sane = [](double seconds) { return seconds >= 0 && seconds <= 2e9; };
    if (!sane(answer.begin) || !sane(answer.end) || !sane(answer.seconds) || answer.sizeBytes == 0 ||
        answer.sizeBytes > kFilmSlotBytes)
        return nonsense;
    if (answer.widthPx == 0 || answer.heightPx == 0 || answer.widthPx > kMostFilmSidePx ||
        answer.heightPx > kMostFilmSidePx)
        return nonsense;
    if (answer.encoding != Image::kSrgb && answer.encoding != Image::kBc1 && answer.encoding != Image::kBc3)
        return nonsense;
    const std::byte* from = memory_.get() + answer.slot * kFilmSlotBytes;
    FilmFrame frame{.serial = answer.serial,
                    .begin = answer.begin,
                    .end = answer.end,
                    .seconds = answer.seconds,
                    .wrapped = answer.wrapped != 0,
                    .pixels = Blob(Bytes(from, from + answer.sizeBytes)),
                    .widthPx = answer.widthPx,
                    .heightPx = answer.heightPx,
                    .encoding = answer.encoding,
                    .mipmaps = answer.mipmaps};
    Image image;
    image.pixels = frame.pixels;
    image.widthPx = frame.widthPx;
    image.heightPx = frame.heightPx;
    image.encoding = frame.encoding;
    image.mipmaps = frame.mipmaps;
    if (!checkImage(image)) return nonsense;
    return frame;
}

/// The pipe has come to its end without a word.
Error FilmProcess::ended() {
    // It may have closed the pipe alone.
    const int status = child_.kill();
    switch (WIFSIGNALED(status) ? WTERMSIG(status) : 0) {
        case SIGSEGV:
        case SIGBUS:
        case SIGABRT:
        case SIGFPE:
        case SIGILL:
        case SIGTRAP:
            return {ErrorCode::kBadInput, "who decodes it crashed on it"};
        case SIGXCPU:
            return {ErrorCode::kLimit,
                    fmt::format("a picture of it takes longer than {} s of the processor", kSeconds)};
        case SIGSYS:
            return {ErrorCode::kBadInput, "who decodes it tried what is forbidden to it"};
        case SIGKILL:
            return {ErrorCode::kBadInput, "who decodes it was ended from outside (out of memory, or by somebody)"};
        default:
            return {ErrorCode::kBadInput, "who decodes it ended without a word"};
    }
}

}  // namespace tessera
