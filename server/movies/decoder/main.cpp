// tessera-decode-film: decodes one film in a process of its own, picture by picture as it is asked. Started by the
// server, not by people.
//
// stdin: the film's file. Descriptor 3: requests, 4: the memory where pictures lie; stdout: answers
// (server/movies/FilmRecords.h).
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <exception>
#include <span>
#include <string>
#include <string_view>

#include "common/confine/Confinement.h"
#include "server/movies/FilmRecords.h"
#include "server/movies/decoder/FilmDecoder.h"
#include "server/movies/decoder/FilmPicture.h"

namespace tessera {
namespace {

constexpr std::string_view kUsage =
    "tessera-decode-film: decodes the film on its stdin, confined;\n"
    "started by tessera-server, not by people.\n"
    "\n"
    "  --parent PID      ends when this process does\n"
    "  --help, --version\n";

/// False: nobody is there any more.
bool tell(const FilmAnswer& answer) {
    for (;;) {
        const ssize_t done = ::write(STDOUT_FILENO, &answer, sizeof answer);
        if (done < 0 && errno == EINTR) continue;
        return done == sizeof answer;
    }
}

int endWith(std::string_view problem) {
    FilmAnswer answer{.kind = FilmAnswer::Kind::kTrouble};
    problem.copy(answer.text.data(), answer.text.size() - 1);
    (void)tell(answer);
    return 0;
}

bool readRequest(FilmRequest& request) {
    for (std::size_t have = 0; have < sizeof request;) {
        const ssize_t got = ::read(kFilmRequestsFd, reinterpret_cast<char*>(&request) + have, sizeof request - have);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        have += static_cast<std::size_t>(got);
    }
    return request.magic == FilmRequest::kMagic && request.slot < kFilmSlots;
}

int decodeOnRequest(pid_t parent) {
    if (Expected<void> bounded = boundResources(kFilmDecoderProfile, parent); !bounded)
        return endWith(bounded.error().message);
    if (Expected<void> confined = confine(kFilmDecoderProfile); !confined) return endWith(confined.error().message);
    renewTime(kTimeForPicture);
    void* const memory =
        ::mmap(nullptr, kFilmSlots * kFilmSlotBytes, PROT_READ | PROT_WRITE, MAP_SHARED, kFilmMemoryFd, 0);
    if (memory == MAP_FAILED) return endWith("there is no memory for pictures");
    auto decoder = FilmDecoder::open(STDIN_FILENO);
    if (!decoder) return endWith(decoder.error().message);
    FilmPictures pictures;
    for (FilmRequest request; readRequest(request);) {
        renewTime(kTimeForPicture);
        const bool following = (request.flags & FilmRequest::kFollowing) != 0;
        const auto shown = following ? (*decoder)->following(request.seconds, (request.flags & FilmRequest::kLoop) != 0)
                                     : (*decoder)->at(request.seconds);
        if (!shown) return endWith(shown.error().message);
        const std::span<std::uint8_t> slot(static_cast<std::uint8_t*>(memory) + request.slot * kFilmSlotBytes,
                                           kFilmSlotBytes);
        const auto written = pictures.write(*shown->frame, (*decoder)->orientation(), slot);
        if (!written) return endWith(written.error().message);
        const FilmAnswer answer{.slot = request.slot,
                                .wrapped = shown->wrapped,
                                .serial = request.serial,
                                .begin = shown->begin,
                                .end = shown->end,
                                .seconds = (*decoder)->length(),
                                .widthPx = written->widthPx,
                                .heightPx = written->heightPx,
                                .mipmaps = written->mipmaps,
                                .encoding = written->encoding,
                                .sizeBytes = written->sizeBytes};
        if (!tell(answer)) break;
    }
    return 0;
}

}  // namespace
}  // namespace tessera

int main(int count, char** values) {
    using namespace tessera;
    const std::span<char*> arguments(values + 1, values + count);
    const std::string_view first = arguments.empty() ? "" : arguments.front();
    if (first == "--help") {
        std::fwrite(kUsage.data(), 1, kUsage.size(), stdout);
        return 0;
    }
    if (first == "--version") {
        fmt::print("tessera-decode-film {}\n", TESSERA_VERSION);
        return 0;
    }
    const std::string_view number = arguments.size() == 2 ? arguments[1] : "";
    pid_t parent = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), parent);
    if (first != "--parent" || error != std::errc() || end != number.data() + number.size()) {
        std::fwrite(kUsage.data(), 1, kUsage.size(), stderr);
        return 2;
    }
    try {
        return decodeOnRequest(parent);
    } catch (const std::exception& exception) {
        return endWith(std::string("it needs more memory than there may be (") + exception.what() + ")");
    }
}
