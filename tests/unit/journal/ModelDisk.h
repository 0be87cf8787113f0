/// A file system whose calls fail where a test says so, and that knows what a kill and what a power cut would leave.
#pragma once

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/sim/journal/FileSystem.h"
#include "tests/property/Seeds.h"

namespace tessera::test {

/// The files are real, below one folder; syncs are the model's alone. A file that could not be synced keeps what it had
/// on the disk, for good: the kernel tells once, and the next sync succeeds.
class ModelDisk : public FileSystem {
public:
    enum class Call { kCreate, kOpen, kAppend, kOverwrite, kTruncate, kSync, kSyncFolder, kRename, kRemove };
    static constexpr std::size_t kCalls = 9;
    struct Fault {
        Call call = Call::kSync;
        std::uint64_t number = 1;  ///< counted from 1
        int error = 0;
        bool forever = false;  ///< all later ones of this kind too
    };
    using Files = std::map<std::string, std::string>;  ///< names without the folder

    std::vector<Fault> faults;     ///< set before anybody else has the disk
    std::function<void()> onCall;  ///< before each call, while no other one runs
    [[nodiscard]] bool failed() const {
        const std::scoped_lock lock(mutex_);
        return failed_;
    }
    /// What could not be synced was synced once more, as if that could help.
    [[nodiscard]] bool syncedAgain() const {
        const std::scoped_lock lock(mutex_);
        return syncedAgain_;
    }
    [[nodiscard]] std::uint64_t count(Call call) const {
        const std::scoped_lock lock(mutex_);
        return counts_[static_cast<std::size_t>(call)];
    }

    /// Files that are there already, and on the disk; or of their contents no more than `contents`, and of their names
    /// those of `names` alone.
    void adopt(const std::string& folder, const Files* contents = nullptr, const Files* names = nullptr) {
        Names durable;
        for (const auto& entry : std::filesystem::directory_iterator(folder)) {
            if (entry.path().filename() == "lock") continue;
            std::ifstream in(entry.path(), std::ios::binary);
            const std::string content(std::istreambuf_iterator<char>(in), {});
            std::shared_ptr<File>& file = names_[entry.path().string()] =
                std::make_shared<File>(File{.content = content, .durable = content});
            if (contents) file->durable = contents->at(entry.path().filename().string());
            if (!names || names->contains(entry.path().filename().string())) durable[entry.path().string()] = file;
        }
        sinceSync_ = {durable};
    }
    /// As a killed process leaves them; what of them is on the disk.
    [[nodiscard]] Files afterKill(bool onTheDisk = false) const {
        const std::scoped_lock lock(mutex_);
        Files files;
        for (const auto& [path, file] : names_) files[nameOf(path)] = onTheDisk ? file->durable : file->content;
        return files;
    }
    /// As a power cut leaves them: what was synced, and with `random` more or less of what was not: some sectors of it
    /// are there, and others before them are not.
    [[nodiscard]] Files afterPowerCut(Random* random) const {
        const std::scoped_lock lock(mutex_);
        Files files;
        for (const auto& [path, file] : sinceSync_[random ? below(*random, sinceSync_.size()) : 0]) {
            std::string& kept = files[nameOf(path)] = file->durable;
            if (!random || file->lost) continue;
            if (file->content.starts_with(kept)) {
                const std::size_t synced = kept.size();
                kept = file->content.substr(0, synced + below(*random, file->content.size() - synced + 1));
                if (oneIn(*random, 2)) loseSectors(*random, kept, synced);
            } else if (below(*random, 2) == 0)
                kept = file->content;
        }
        return files;
    }
    static void loseSectors(Random& random, std::string& content, std::size_t from) {
        constexpr std::size_t kSector = 512;
        for (std::size_t at = from; at < content.size(); at += kSector - at % kSector)
            if (oneIn(random, 3)) {
                const std::size_t bytes = std::min(kSector - at % kSector, content.size() - at);
                content.replace(at, bytes, bytes, '\0');
            }
    }
    static void write(const Files& files, const std::string& folder) {
        std::filesystem::remove_all(folder);
        std::filesystem::create_directory(folder);
        for (const auto& [name, content] : files) std::ofstream(folder + "/" + name, std::ios::binary) << content;
    }

    int create(const std::string& path, int& file) override {
        return call(Call::kCreate, [&] {
            if (const int error = FileSystem::create(path, file)) return error;
            std::shared_ptr<File>& made = names_[path];
            if (!made) made = std::make_shared<File>();
            made->content.clear();
            open_[file] = made;
            namesChanged();
            return 0;
        });
    }
    int open(const std::string& path, int& file) override {
        return call(Call::kOpen, [&] {
            const int error = FileSystem::open(path, file);
            if (error == 0) open_[file] = names_.at(path);
            return error;
        });
    }
    int append(int file, ByteSpan first, ByteSpan second) override {
        std::string bytes(asText(first));
        bytes += asText(second);
        const auto put = [&](std::size_t count) {
            const int error = FileSystem::append(file, asBytes(std::string_view(bytes).substr(0, count)), {});
            if (error == 0) open_[file]->content += bytes.substr(0, count);
            return error;
        };
        return call(
            Call::kAppend, [&] { return put(bytes.size()); }, [&] { (void)put(bytes.size() / 2); });
    }
    int overwrite(int file, ByteSpan bytes) override {
        return call(Call::kOverwrite, [&] {
            const int error = FileSystem::overwrite(file, bytes);
            if (error == 0) open_[file]->content.replace(0, bytes.size(), asText(bytes));
            return error;
        });
    }
    int truncate(int file, std::uint64_t bytes) override {
        return call(Call::kTruncate, [&] {
            const int error = FileSystem::truncate(file, bytes);
            if (error == 0) open_[file]->content.resize(bytes);
            return error;
        });
    }
    int sync(int file) override {
        const std::function<int()> done = [&] {
            syncedAgain_ |= open_[file]->lost;
            if (!open_[file]->lost) open_[file]->durable = open_[file]->content;
            return 0;
        };
        return call(Call::kSync, done, [&] { syncedAgain_ |= std::exchange(open_[file]->lost, true); });
    }
    int syncFolder(const std::string&) override {
        const std::function<int()> done = [&] {
            syncedAgain_ |= folderLost_;
            if (!folderLost_) sinceSync_ = {names_};
            return 0;
        };
        return call(Call::kSyncFolder, done, [&] { syncedAgain_ |= std::exchange(folderLost_, true); });
    }
    int rename(const std::string& from, const std::string& to) override {
        return call(Call::kRename, [&] {
            if (const int error = FileSystem::rename(from, to)) return error;
            names_[to] = names_.at(from);
            names_.erase(from);
            namesChanged();
            return 0;
        });
    }
    int remove(const std::string& path) override {
        return call(Call::kRemove, [&] {
            if (const int error = FileSystem::remove(path)) return error;
            names_.erase(path);
            namesChanged();
            return 0;
        });
    }
    void close(int file) override {
        const std::scoped_lock lock(mutex_);
        open_.erase(file);
        FileSystem::close(file);
    }

private:
    struct File {
        std::string content, durable;
        bool lost = false;
    };
    using Names = std::map<std::string, std::shared_ptr<File>>;

    int call(Call kind, const std::function<int()>& work, const std::function<void()>& half = {}) {
        const std::scoped_lock lock(mutex_);
        if (onCall) onCall();
        const std::uint64_t number = ++counts_[static_cast<std::size_t>(kind)];
        const auto fault = std::ranges::find_if(faults, [&](const Fault& f) {
            return f.call == kind && (number == f.number || (number > f.number && f.forever));
        });
        if (fault == faults.end()) return work();
        failed_ = true;
        if (half) half();
        return fault->error;
    }
    void namesChanged() { sinceSync_.push_back(names_); }
    static std::string nameOf(const std::string& path) { return path.substr(path.rfind('/') + 1); }

    mutable std::recursive_mutex mutex_;
    Names names_;
    std::vector<Names> sinceSync_{{}};  ///< first as they were then, then after each change
    std::map<int, std::shared_ptr<File>> open_;
    std::array<std::uint64_t, kCalls> counts_{};
    bool failed_ = false, folderLost_ = false, syncedAgain_ = false;
};

/// For copies that no power cut threatens. `powerCut`: there was one before, so the machine has been started again.
class UnsyncedDisk : public FileSystem {
public:
    explicit UnsyncedDisk(bool powerCut = false) : powerCut_(powerCut) {}

private:
    int sync(int) override { return 0; }
    int syncFolder(const std::string&) override { return 0; }
    std::string boot() const override { return powerCut_ ? "after the power cut" : FileSystem::boot(); }

    bool powerCut_;
};

}  // namespace tessera::test
