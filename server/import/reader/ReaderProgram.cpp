#include "server/import/reader/ReaderProgram.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/Hash.h"
#include "common/confine/Confinement.h"
#include "server/import/Record.h"
#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/ReadProgress.h"

namespace tessera {
namespace {

constexpr std::string_view kOptions =
    "in confinement; started by tessera-server, not by people. The result goes to\n"
    "stdout as binary records.\n"
    "\n"
    "  --file PATH          the file (absolute, no symbolic links)\n"
    "  --memory BYTES       bound on address space\n"
    "  --cpu SECONDS        bound on processor time\n"
    "  --cpu-per-mebibyte S so much more for each MiB that is read\n"
    "  --most-cpu SECONDS   never more than that\n"
    "  --nodes N, --depth N bounds on the scene\n"
    "  --verbatim           geometry exactly as the file has it, polygons fanned\n"
    "  --whole              refuses files of which triangles or points are not there\n"
    "  --variant P:S=N      of USD: prim P shows variant N of its set S; repeatable\n"
    "  --parent PID         ends when this process does\n"
    "  --allow-unconfined   reads even where the system cannot confine\n"
    "  --endings            the endings of all files that are read, a line each\n"
    "  --help, --version\n";

/// As many as there are by default of the 2 GiB, rounded up.
constexpr std::size_t kMemoryPerFreeNode = (std::size_t{2} << 30) / ReadLimits::kFreeNodes + 1;

struct Arguments {
    std::string file;
    ConfinementProfile profile = kImporterProfile;
    ProcessorTime time{.given = std::chrono::seconds(10)};
    pid_t parent = 0;
    bool allowUnconfined = false;
    ReadLimits limits;
};

void writeAll(ByteSpan bytes) {
    while (!bytes.empty()) {
        const ssize_t done = ::write(STDOUT_FILENO, bytes.data(), bytes.size());
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) ::_exit(1);  // the parent has stopped listening
        bytes = bytes.subspan(static_cast<std::size_t>(done));
    }
}

/// Many small ones at once: a scene of small meshes has hundreds of thousands. Takes no memory.
void writeRecord(ImportRecord::Kind kind, ByteSpan payload) {
    static std::array<std::byte, std::size_t{1} << 16> waiting;
    static std::size_t count = 0;
    const auto flush = [] { writeAll(ByteSpan(waiting).first(std::exchange(count, 0))); };
    ImportRecord record;
    record.kind = kind;
    record.sizeBytes = payload.size();
    record.hash = hash64(payload);
    for (const ByteSpan part : {ByteSpan(std::as_bytes(std::span(&record, 1))), payload}) {
        if (count + part.size() > waiting.size()) flush();
        if (part.size() > waiting.size()) {
            writeAll(part);
            continue;
        }
        std::ranges::copy(part, waiting.begin() + static_cast<std::ptrdiff_t>(count));
        count += part.size();
    }
    if (kind == ImportRecord::Kind::kEnd || kind == ImportRecord::Kind::kError) flush();
}

/// Takes no memory: it may be what is short.
void writeError(ErrorCode code, std::string_view message) {
    char payload[2048];
    payload[0] = static_cast<char>(code);
    const std::size_t length = std::min(message.size(), sizeof(payload) - 1);
    std::memcpy(payload + 1, message.data(), length);
    writeRecord(ImportRecord::Kind::kError, asBytes(std::string_view(payload, length + 1)));
}

void writeScene(const PlainScene& scene) {
    std::string bytes;
    if (!scene.file.SerializeToString(&bytes)) return writeError(ErrorCode::kLimit, "its scene is larger than 2 GiB");
    std::uint64_t size = bytes.size();
    for (const Bytes& blob : scene.blobs) size += blob.size();
    writeRecord(ImportRecord::Kind::kSize, std::as_bytes(std::span(&size, 1)));
    writeRecord(ImportRecord::Kind::kScene, asBytes(bytes));
    for (const Bytes& blob : scene.blobs) writeRecord(ImportRecord::Kind::kBlob, blob);
    for (const std::string& note : scene.notes)
        writeRecord(ImportRecord::Kind::kNote, asBytes(std::string_view(note).substr(0, 2000)));
    for (const std::string& fault : scene.faults)
        writeRecord(ImportRecord::Kind::kFault, asBytes(std::string_view(fault).substr(0, 2000)));
    for (const std::string& path : filesLookedFor())
        writeRecord(ImportRecord::Kind::kFile, asBytes(std::string_view(path).substr(0, 4096)));
    writeRecord(ImportRecord::Kind::kEnd, {});
}

std::optional<Arguments> parse(std::span<char*> arguments) {
    Arguments result;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const std::string_view name = arguments[i];
        if (name == "--allow-unconfined") {
            result.allowUnconfined = true;
            continue;
        }
        if (name == "--verbatim") {
            result.limits.verbatim = true;
            continue;
        }
        if (name == "--whole") {
            result.limits.whole = true;
            continue;
        }
        if (i + 1 >= arguments.size()) return std::nullopt;
        const std::string_view value = arguments[++i];
        if (name == "--file") {
            result.file = value;
            continue;
        }
        if (name == "--variant") {
            result.limits.variants.emplace_back(value);
            continue;
        }
        std::uint64_t number = 0;
        const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
        if (error != std::errc() || end != value.data() + value.size()) return std::nullopt;
        if (name == "--memory") {
            result.profile.memoryBytes = number;
            result.limits.freeNodes = std::max(ReadLimits::kFreeNodes, number / kMemoryPerFreeNode);
        } else if (name == "--cpu") {
            result.time.given = std::chrono::seconds(number);
        } else if (name == "--cpu-per-mebibyte") {
            result.time.perMebibyte = std::chrono::seconds(number);
        } else if (name == "--most-cpu") {
            result.time.most = std::chrono::seconds(number);
        } else if (name == "--parent") {
            result.parent = static_cast<pid_t>(number);
        } else if (name == "--nodes") {
            result.limits.maxNodes = number;
        } else if (name == "--depth") {
            result.limits.maxDepth = number;
        } else {
            return std::nullopt;
        }
    }
    if (result.file.empty() || result.file.front() != '/') return std::nullopt;
    return result;
}

Expected<void> bound(const Arguments& arguments) {
    if (Expected<void> bounded = boundResources(arguments.profile, arguments.parent); !bounded) return bounded;
    return boundProcessorTime(arguments.time);
}

Expected<void> confineFor(const Arguments& arguments) {
    Expected<void> confined = confine(arguments.profile, arguments.file, arguments.allowUnconfined);
    if (!confined && confined.error().code == ErrorCode::kUnsupported)
        return fail(ErrorCode::kUnsupported,
                    confined.error().message + "; --allow-unconfined-import reads it all the same, at your own risk");
    return confined;
}

void run(const ReaderProgram& program, const Arguments& arguments) {
    try {
        if (const Expected<void> bounded = bound(arguments); !bounded)
            return writeError(bounded.error().code, bounded.error().message);
        if (program.prepare) program.prepare();
        listenToProgress([](std::uint64_t done, std::uint64_t total, bool converting) {
            const ImportProgress progress{done, total, converting ? 1U : 0U};
            writeRecord(ImportRecord::Kind::kProgress, std::as_bytes(std::span(&progress, 1)));
        });
        if (const Expected<void> confined = confineFor(arguments); !confined)
            return writeError(confined.error().code, confined.error().message);
        const Expected<PlainScene> scene = program.read(arguments.file, arguments.limits);
        if (!scene) return writeError(scene.error().code, scene.error().message);
        if (arguments.limits.whole && !scene->missing.empty())
            return writeError(ErrorCode::kBadInput, scene->missing.front());
        writeScene(*scene);
    } catch (const std::bad_alloc&) {
        char message[128];
        std::snprintf(message, sizeof(message),
                      "it needs more than %zu MiB of memory to read: --import-memory gives it more",
                      arguments.profile.memoryBytes >> 20);
        writeError(ErrorCode::kLimit, message);
    } catch (const std::exception& exception) {
        writeError(ErrorCode::kBadInput, exception.what());
    }
}

void print(const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
}

}  // namespace

int runReaderProgram(const ReaderProgram& program, int count, char** values) {
    const std::span<char*> arguments(values + 1, values + count);
    const std::string_view first = arguments.empty() ? "" : arguments.front();
    if (first == "--help") {
        print(fmt::format("{}: reads one {}\n{}", program.name, program.what, kOptions));
        return 0;
    }
    if (first == "--endings") {
        for (const std::string& ending : program.endings()) print(ending + "\n");
        return 0;
    }
    if (first == "--version") {
        print(fmt::format("{} {}\n", program.name, program.version));
        return 0;
    }
    const std::optional<Arguments> parsed = parse(arguments);
    if (!parsed) {
        fmt::print(stderr, "{}: these arguments make no sense; see --help\n", program.name);
        return 2;
    }
    run(program, *parsed);
    // Nothing is left to do that is worth the time of tearing libraries down.
    ::_exit(0);
}

}  // namespace tessera
