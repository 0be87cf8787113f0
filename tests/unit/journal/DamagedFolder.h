/// Journals that real servers have left, and what random damage does to their files.
#pragma once

#include <algorithm>
#include <cstring>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "server/sim/journal/JournalCompaction.h"
#include "tests/unit/journal/KeptShow.h"

namespace tessera::test {

using JournalBytes = ModelDisk::Files;

inline JournalBytes bytesIn(const std::string& folder) {
    JournalBytes files;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().filename() == "lock") continue;
        std::ifstream in(entry.path(), std::ios::binary);
        files[entry.path().filename().string()] = std::string(std::istreambuf_iterator<char>(in), {});
    }
    return files;
}

/// How a scene stands, and the view that was set.
struct GrantedState {
    Standing standing;
    std::string view;
    bool operator==(const GrantedState&) const = default;
};
inline GrantedState grantedIn(const JournalState& state) {
    const RecordContent view = encodeJournal(journal::View{state.view.value_or(ViewState())});
    return {{state.scene.stateHash(), state.history.undoDepth(), state.history.redoDepth()},
            std::string(asText(view.bytes()))};
}

/// A server that is started in a folder, and ends at once.
struct Start {
    explicit Start(const std::string& folder, bool powerCut = false) {
        Expected<Journal::Opened> opened = openJournal(folder, arrays, words.log, {}, {}, powerCut);
        if (opened)
            state = grantedIn(opened->state);
        else
            refusal = opened.error();
    }
    BlobStore arrays;
    ReadableLog words;
    std::optional<GrantedState> state;
    std::optional<Error> refusal;
};

/// A journal whose last edit and last view somebody was told are done.
struct LeftJournal {
    JournalBytes files;
    GrantedState granted;
};

/// Replaces all logs but the newest one.
inline void makeSnapshot(const std::string& folder) {
    const Expected<JournalFolder> held = JournalFolder::hold(folder, std::make_shared<UnsyncedDisk>());
    ASSERT_TRUE(held) << held.error().message;
    const Expected<std::uint64_t> made = compactJournal(*held, held->files()->lastLog(), {}, false);
    ASSERT_TRUE(made) << made.error().message;
}

/// Several servers of one show. The last one is killed, or ends in order; `snapshot`: one was made before it. From
/// equal seeds come equal scenes, and with another `turn` other edits.
inline LeftJournal leftJournal(Random& random, int servers, bool killed, bool snapshot, std::uint64_t turn = 0) {
    const TestFolder folder;
    ReadableLog words;
    BlobStore arrays;
    KeptShow kept(random);
    Wall wall;
    wall.screens = {Screen{.name = "front"}};
    ViewSource view(wall, "");
    LeftJournal left;
    for (int server = 0; server < servers; ++server) {
        const bool last = server + 1 == servers;
        JournalLimits limits;
        limits.syncEvery = std::chrono::hours(1);  // nothing is written while files are copied
        if (snapshot && last && server > 0) makeSnapshot(folder / "wall");
        Expected<Journal::Opened> opened = openJournal(folder / "wall", arrays, words.log, limits);
        EXPECT_TRUE(opened) << opened.error().message;
        if (!opened) return left;
        if (server == 0)
            kept.load(*opened->journal), random.discard(turn);
        else
            kept.show.connectAnew();
        for (int part = 0; part < 6; ++part) {
            kept.frames(*opened->journal, 1 + below(random, 8));
            View stand;
            stand.position = Vec3d(static_cast<double>(below(random, 1000)), server, part);
            view.keepBookmark(below(random, 9), stand);
            opened->journal->viewIs(view);
        }
        if (!last || !killed) {
            opened->journal->ends(kept.next);
            continue;
        }
        EXPECT_TRUE(waitUntilWritten(*opened->journal));
        left.files = bytesIn(folder / "wall");
    }
    if (left.files.empty()) left.files = bytesIn(folder / "wall");
    left.granted.standing = standingOf(kept.show.simulation());
    left.granted.view = asText(encodeJournal(journal::View{view.state()}).bytes());
    return left;
}

/// Where the records of a file begin, and where the last one ends.
inline std::vector<std::size_t> recordsIn(const std::string& file) {
    std::vector<std::size_t> places{kJournalMark.size()};
    for (RecordHeader header; places.back() + sizeof(header) <= file.size();) {
        std::memcpy(&header, file.data() + places.back(), sizeof(header));
        places.push_back(places.back() + sizeof(header) + header.bytes);
    }
    return places;
}

/// Damages files as disks and people do.
class Damage {
public:
    explicit Damage(JournalBytes whole) : files(std::move(whole)) {}

    void anywhere(Random& random) {
        if (files.empty()) return;
        const std::string name = pick(random);
        std::string& file = files[name];
        const std::size_t sector = oneIn(random, 2) ? 512 : 4096;
        const std::size_t at = placeIn(random, file, sector), bytes = std::min(sector, file.size() - at);
        const auto say = [&](const std::string& what) {
            done += fmt::format("{} {} bytes at {} of {}; ", what, bytes, at, name);
            hit.insert(name);
        };
        switch (below(random, 15)) {
            case 0:
            case 1:
                say("zeroed");
                file.replace(at, bytes, bytes, '\0');
                return;
            case 2:
                say("a bit flipped in");
                if (bytes > 0) flip(random, file[at + below(random, bytes)]);
                return;
            case 3:
                say("bytes changed in");
                for (int i = 0; i < 8 && bytes > 0; ++i) file[at + below(random, bytes)] = static_cast<char>(random());
                return;
            case 4:
                say("noise over");
                for (std::size_t i = 0; i < bytes; ++i) file[at + i] = static_cast<char>(random());
                return;
            case 5: {
                say("swapped");
                std::string& other = files[pick(random)];
                const std::size_t to = placeIn(random, other, sector);
                const std::size_t both = std::min(bytes, other.size() - to);
                if (&other == &file && std::max(at, to) - std::min(at, to) < both) return;
                std::swap_ranges(file.begin() + static_cast<std::ptrdiff_t>(at),
                                 file.begin() + static_cast<std::ptrdiff_t>(at + both),
                                 other.begin() + static_cast<std::ptrdiff_t>(to));
                return;
            }
            case 6:
                say("doubled");
                file.insert(at, file.substr(at, bytes));
                return;
            case 7: {
                say("another sector over");
                const std::string& other = files[pick(random)];
                const std::string copy = other.substr(placeIn(random, other, sector), bytes);
                file.replace(at, copy.size(), copy);
                return;
            }
            case 8:
                say("left out");
                file.erase(at, bytes);
                return;
            case 9:
                say("the end cut off from");
                file.resize(at);
                return;
            case 10:
                say("the end zeroed from");
                file.replace(at, file.size() - at, file.size() - at, '\0');
                return;
            case 11:
            case 12: {  // as a kill leaves a record under way
                const auto newest = std::find_if(files.rbegin(), files.rend(), [](const auto& entry) {
                    return entry.first.starts_with("log-") && entry.first.find('.') == std::string::npos;
                });
                if (newest == files.rend()) return;
                done += fmt::format("{} of its own bytes at the end of {}; ", sector, newest->first);
                hit.insert(newest->first);
                newest->second += newest->second.substr(placeIn(random, newest->second, sector), sector);
                return;
            }
            case 13:
                say("removed");
                files.erase(name);
                return;
            default: {
                std::string other = pick(random);
                if (oneIn(random, 2)) other = fmt::format("log-{:010}", 1 + below(random, 12));
                say("exchanged with " + other);
                hit.insert(other);
                std::swap(files[name], files[other]);
                std::erase_if(files, [](const auto& entry) { return entry.second.empty(); });
            }
        }
    }

    JournalBytes files;
    std::set<std::string> hit;  ///< names
    std::string done;           ///< in words

private:
    /// (Each file as often as any other one: a small one holds as much.)
    std::string pick(Random& random) {
        const auto file = std::next(files.begin(), static_cast<std::ptrdiff_t>(below(random, files.size())));
        hit.insert(file->first);
        return file->first;
    }
    static std::size_t placeIn(Random& random, const std::string& file, std::size_t sector) {
        const std::size_t at = below(random, file.size() + 1);
        return oneIn(random, 2) ? at : at / sector * sector;
    }
    static void flip(Random& random, char& c) { c = static_cast<char>(c ^ (1 << below(random, 8))); }
};

}  // namespace tessera::test
