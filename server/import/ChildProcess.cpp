#include "server/import/ChildProcess.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>

#include "common/base/ChildProgram.h"
#include "common/base/FileHandle.h"
#include "common/base/Shortage.h"
#include "server/import/AssetFolders.h"
#include "server/import/FormatTable.h"
#include "server/import/Record.h"

namespace tessera {
namespace {

using SteadyClock = std::chrono::steady_clock;

struct Started {
    ChildProgram child;
    FileHandle output;
};

Expected<Started> start(const std::string& program, const std::string& file, const ImportOptions& options) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
        noteFailedCall(errno);
        return fail(ErrorCode::kFailed, fmt::format("pipe: {}", std::strerror(errno)));
    }
    FileHandle readEnd(ends[0]);
    FileHandle writeEnd(ends[1]);

    std::vector<std::string> arguments = {"--file",
                                          file,
                                          "--parent",
                                          std::to_string(::getpid()),
                                          "--memory",
                                          std::to_string(options.maxMemoryBytes),
                                          "--cpu",
                                          std::to_string(options.maxCpuTime.count()),
                                          "--cpu-per-mebibyte",
                                          std::to_string(ImportOptions::kCpuTimePerMebibyte.count()),
                                          "--most-cpu",
                                          std::to_string(std::max(options.mostCpuTime, options.maxCpuTime).count()),
                                          "--depth",
                                          std::to_string(options.maxDepth),
                                          "--nodes",
                                          std::to_string(options.maxNodes)};
    if (options.allowUnconfined) arguments.emplace_back("--allow-unconfined");
    if (options.verbatim) arguments.emplace_back("--verbatim");
    if (options.whole) arguments.emplace_back("--whole");
    for (const std::vector<std::string>* variants :
         {&options.variants, options.placing ? &options.placing->variants : nullptr})
        for (std::size_t i = 0; variants != nullptr && i < variants->size(); ++i)
            arguments.insert(arguments.end(), {"--variant", (*variants)[i]});
    Expected<ChildProgram> child = ChildProgram::start(
        {.path = program, .arguments = std::move(arguments), .environment = {}, .files = {{writeEnd.get(), 1}}});
    if (!child) return fail(child.error().code, "files cannot be imported: " + child.error().message);
    return Started{std::move(*child), std::move(readEnd)};
}

enum class ReadEnd { kComplete, kClosed, kDeadline, kCancelled };

/// A pipe, read in large pieces: records may be small and very many.
class ImporterPipe {
public:
    ImporterPipe(int fd, const ImportOptions& options)
        : fd_(fd), watch_(options.watch.get()), deadline_(SteadyClock::now() + options.deadline) {}

    /// Fills `target`. kClosed: the writer is gone before that.
    ReadEnd read(std::span<std::byte> target) {
        while (!target.empty()) {
            std::size_t taken = std::min(kept_.size(), target.size());
            std::ranges::copy(kept_.first(taken), target.begin());
            kept_ = kept_.subspan(taken);
            if (taken == 0) {
                const bool isSmall = target.size() < buffer_.size();
                const std::span<std::byte> into = isSmall ? std::span<std::byte>(buffer_) : target;
                if (const ReadEnd end = readSome(into, taken); end != ReadEnd::kComplete) return end;
                if (isSmall) kept_ = ByteSpan(buffer_).first(std::exchange(taken, 0));
            }
            target = target.subspan(taken);
        }
        return ReadEnd::kComplete;
    }

    void isReading(const ImportProgress& progress) {
        using enum ImportWatch::Stage;
        say(progress.converting != 0 ? kConverting : kReading, progress.done, progress.total);
    }
    /// So much follows.
    void comes(std::uint64_t bytes) { comes_ = std::max<std::uint64_t>(1, bytes); }

private:
    /// One byte at least.
    ReadEnd readSome(std::span<std::byte> target, std::size_t& count) {
        while (true) {
            if (watch_ != nullptr && watch_->cancelled()) return ReadEnd::kCancelled;
            const auto left =
                std::chrono::duration_cast<std::chrono::milliseconds>(deadline_ - SteadyClock::now()).count();
            if (left <= 0) return ReadEnd::kDeadline;
            constexpr long kLook = 100;  // at whether it is still wanted
            pollfd waiting{fd_, POLLIN, 0};
            const int ready = ::poll(&waiting, 1, static_cast<int>(std::min<long>(left, kLook)));
            if (ready < 0 && errno != EINTR) return ReadEnd::kClosed;
            if (ready <= 0) continue;
            const ssize_t got = ::read(fd_, target.data(), target.size());
            if (got == 0) return ReadEnd::kClosed;
            if (got < 0 && errno != EINTR && errno != EAGAIN) return ReadEnd::kClosed;
            if (got <= 0) continue;
            count = static_cast<std::size_t>(got);
            if (comes_ > 0) say(ImportWatch::Stage::kHandingOver, came_ += count, comes_);
            return ReadEnd::kComplete;
        }
    }
    /// What the child says often is passed on ten times a second, and each new stage at once.
    void say(ImportWatch::Stage stage, std::uint64_t done, std::uint64_t total) {
        const SteadyClock::time_point now = SteadyClock::now();
        if (watch_ == nullptr || (stage == stage_ && now < next_)) return;
        stage_ = stage;
        next_ = now + std::chrono::milliseconds(100);
        watch_->at(stage, done, total);
    }

    int fd_;
    ImportWatch* watch_;
    SteadyClock::time_point deadline_, next_ = {};
    std::uint64_t comes_ = 0, came_ = 0;
    ImportWatch::Stage stage_ = ImportWatch::Stage::kWaiting;
    Bytes buffer_ = Bytes(std::size_t{1} << 16);
    ByteSpan kept_;  ///< of the buffer, not yet taken
};

/// False: it has another size.
template <typename Value>
[[nodiscard]] bool takeValue(ByteSpan payload, Value& value) {
    if (payload.size() != sizeof(Value)) return false;
    std::memcpy(&value, payload.data(), sizeof(Value));
    return true;
}

/// Of the two bounds the one that a file of so many bytes reached. What it names may have given it more.
std::string timeInWords(std::uintmax_t bytes, const ImportOptions& options) {
    const auto most = std::max(options.mostCpuTime, options.maxCpuTime).count();
    const auto own = options.maxCpuTime.count() +
                     ImportOptions::kCpuTimePerMebibyte.count() * static_cast<std::int64_t>(bytes >> 20);
    if (own >= most && own > options.maxCpuTime.count())
        return fmt::format("it needs more than {} s of processor time, the most for a file of its size", most);
    return fmt::format("it needs more than {} s of processor time: {} s, and {} s for each MiB that was read", own,
                       options.maxCpuTime.count(), ImportOptions::kCpuTimePerMebibyte.count());
}

std::string signalInWords(int signal, std::uintmax_t bytes, const ImportOptions& options) {
    switch (signal) {
        case SIGSEGV:
        case SIGBUS:
            return "its reader crashed on it (segmentation fault: malformed, or nested too deeply)";
        case SIGABRT:
            return "its reader gave up on it (aborted)";
        case SIGFPE:
            return "its reader crashed on it (arithmetic error)";
        case SIGILL:
        case SIGTRAP:
            return "its reader crashed on it (illegal instruction)";
        case SIGXCPU:
            return timeInWords(bytes, options);
        case SIGXFSZ:
            return "its reader tried to write a file, which is forbidden";
        case SIGSYS:
            return "its reader tried a system call that is forbidden to it (network, processes or the like)";
        case SIGKILL:
            return "its reader was killed (out of memory, or by somebody)";
        default:
            return fmt::format("its reader was ended by signal {} ({})", signal, strsignal(signal));
    }
}

/// The child ended before it had said everything.
Error explainEnd(int status, const std::string& file, const ImportOptions& options) {
    if (WIFSIGNALED(status)) {
        const int signal = WTERMSIG(status);
        std::error_code unknown;
        const std::uintmax_t bytes = std::filesystem::file_size(file, unknown);
        return {signal == SIGXCPU ? ErrorCode::kLimit : ErrorCode::kBadInput,
                signalInWords(signal, unknown ? 0 : bytes, options)};
    }
    return {ErrorCode::kBadInput,
            fmt::format("its reader ended early without a result (exit code {})", WEXITSTATUS(status))};
}

tl::unexpected<Error> errorFrom(ByteSpan payload) {
    if (payload.size() < 2) return fail(ErrorCode::kBadInput, "its reader failed without saying why");
    const auto number = std::to_integer<int>(payload[0]);
    const bool known = number >= 0 && number <= static_cast<int>(ErrorCode::kFailed);
    std::string message(asText(payload.subspan(1)));
    // A foreign file's words go to a terminal: no control characters.
    for (char& c : message)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
    return fail(known ? static_cast<ErrorCode>(number) : ErrorCode::kBadInput, std::move(message));
}

constexpr std::size_t kMaxTextBytes = 4096;
constexpr std::size_t kMaxChildNotes = 64;
constexpr std::size_t kMaxChildFiles = 4096;
constexpr std::size_t kMaxBlobs = 8'000'000;

/// Where a caller names tessera-import itself, the others lie beside it.
std::string programFor(const std::string& file, const ImportOptions& options) {
    const std::string_view name = readingProgram(lowerCaseExtension(file));
    if (options.importerProgram.empty()) return pathBesideThisProgram(name);
    if (name == FormatRow{}.program) return options.importerProgram;
    return options.importerProgram.substr(0, options.importerProgram.rfind('/') + 1).append(name);
}

}  // namespace

Expected<ImporterOutput> readImporterOutput(int pipe, const ImportOptions& options,
                                            const std::function<Error()>& cutShort) {
    ImporterPipe from(pipe, options);
    const auto ended = [&](ReadEnd end) -> tl::unexpected<Error> {
        if (end == ReadEnd::kCancelled) return tl::unexpected(*options.watch->cancelled());
        if (end == ReadEnd::kDeadline)
            return fail(ErrorCode::kLimit,
                        fmt::format("it takes longer than {} s to read", options.deadline.count() / 1000.0));
        return tl::unexpected(cutShort());
    };
    const auto nonsense = [](std::string_view what) {
        return fail(ErrorCode::kBadInput, fmt::format("its reader's answer is damaged ({})", what));
    };

    ImporterOutput output;
    std::size_t total = 0;
    bool haveScene = false;
    while (true) {
        ImportRecord record;
        if (const ReadEnd end = from.read(std::as_writable_bytes(std::span(&record, 1))); end != ReadEnd::kComplete)
            return ended(end);
        if (record.magic != ImportRecord::kMagic) return nonsense("not a record");
        const bool isText = record.kind == ImportRecord::Kind::kNote || record.kind == ImportRecord::Kind::kFault ||
                            record.kind == ImportRecord::Kind::kError || record.kind == ImportRecord::Kind::kFile;
        if (record.sizeBytes > options.maxResultBytes || total + record.sizeBytes > options.maxResultBytes)
            return fail(ErrorCode::kLimit,
                        fmt::format("it becomes more than {} MiB in memory", options.maxResultBytes >> 20));
        if (isText && record.sizeBytes > kMaxTextBytes) return nonsense("a long message");
        total += record.sizeBytes;

        Bytes payload(record.sizeBytes);
        if (const ReadEnd end = from.read(payload); end != ReadEnd::kComplete) return ended(end);
        if (hash64(payload) != record.hash) return nonsense("wrong hash");

        switch (record.kind) {
            case ImportRecord::Kind::kScene:
                if (haveScene) return nonsense("two scenes");
                haveScene = true;
                output.scene = std::move(payload);
                break;
            case ImportRecord::Kind::kBlob:
                if (output.blobs.size() >= kMaxBlobs) return nonsense("too many arrays");
                output.blobs.push_back(Blob(std::move(payload)).paged());
                break;
            case ImportRecord::Kind::kNote:
                if (output.notes.size() < kMaxChildNotes) output.notes.emplace_back(asText(payload));
                break;
            case ImportRecord::Kind::kFault:
                if (output.faults.size() < kMaxChildNotes) output.faults.emplace_back(asText(payload));
                break;
            case ImportRecord::Kind::kFile:
                if (output.files.size() < kMaxChildFiles) output.files.emplace_back(asText(payload));
                break;
            case ImportRecord::Kind::kProgress: {
                ImportProgress progress;
                if (!takeValue(payload, progress)) return nonsense("no progress");
                from.isReading(progress);
                break;
            }
            case ImportRecord::Kind::kSize: {
                std::uint64_t bytes = 0;
                if (!takeValue(payload, bytes)) return nonsense("no size");
                from.comes(bytes);
                break;
            }
            case ImportRecord::Kind::kError:
                return errorFrom(payload);
            case ImportRecord::Kind::kEnd:
                if (!haveScene) return nonsense("no scene");
                return output;
            default:
                return nonsense("unknown record");
        }
    }
}

Expected<ImporterOutput> runImporter(const std::string& file, const ImportOptions& options) {
    const std::string program = programFor(file, options);
    if (options.watch) {
        if (const std::optional<Error> why = options.watch->cancelled()) return tl::unexpected(*why);
        options.watch->at(ImportWatch::Stage::kReading);
    }
    Expected<Started> started = start(program, file, options);
    if (!started) return tl::unexpected(started.error());
    Expected<ImporterOutput> output = readImporterOutput(
        started->output.get(), options, [&] { return explainEnd(started->child.reap(), file, options); });
    if (!output) return output;
    if (options.watch) options.watch->at(ImportWatch::Stage::kBuilding);
    // Of what it says of other places nobody looks at anything.
    const std::string folder = file.substr(0, file.rfind('/') + 1);
    std::erase_if(output->files, [&](const std::string& path) {
        return !path.starts_with(folder) || path.find("/../") != std::string::npos ||
               path.find('\0') != std::string::npos;
    });
    return output;
}

}  // namespace tessera
