/// Plays the films of a scene: what each Movie shows next, as edits of the server's own.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/Clock.h"
#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"
#include "server/movies/FilmProcess.h"

namespace tessera {

/// Follows the Movies of a scene through its lists. A film is decoded by a process of its own while it plays, or its
/// time is set; of a few pictures ahead the newest that is due is taken, those that come too late are left out. Nobody
/// waits: neither for a file, nor for a picture. What is said goes into frames as edits that are no step of anybody:
/// `time`, `problem`, and of the Image the pixels, size, encoding and mipmaps, only the bytes that differ where the
/// size stays.
///
/// A film's clock begins with its first picture, and stands where there is a problem. A film that stands has no process
/// after kPatience frames, nor where another one wants its place. At most kMostFilms are decoded at once; others wait,
/// and say so. Which picture a frame shows depends on how fast it was decoded: who records has what was shown. Not
/// thread-safe.
class Movies {
public:
    /// Of the edits; nobody waits for them.
    static constexpr std::uint64_t kTicket = ~std::uint64_t{3};
    static constexpr std::size_t kMostFilms = 8, kMostAhead = 3;
    static constexpr int kPatience = 600;

    /// `open`: opens a film's file for reading, by what a Movie says; called on a thread of its own, may be slow.
    /// `program`: as FilmProcess's. `patience`: as Platform::childPatience.
    using Opener = std::function<Expected<FileHandle>(const std::string& file)>;
    explicit Movies(Opener open, std::string program = {}, Duration patience = {});
    ~Movies();

    /// After each list applied to the scene, with that list; null: anything may have changed.
    void update(const Aspect& scene, const ChangeList* list);
    /// One frame: what is to be written, a list for each Movie that has something to say. `seconds`: by how much its
    /// time goes on. `scene`: as of the last update. What is not applied is said again.
    [[nodiscard]] std::vector<ChangeList> advance(const Aspect& scene, double seconds, TimePoint now);
    /// What goes on in between: files that are open, pictures that have come. `advance` does so too.
    void attend(const Aspect& scene, TimePoint now);
    /// How many have neither a first picture nor a problem yet.
    [[nodiscard]] std::size_t awaited() const;
    /// For a person, since the last call.
    [[nodiscard]] std::vector<std::string> takeRemarks() { return std::exchange(remarks_, {}); }

    [[nodiscard]] std::size_t count() const { return reels_.size(); }
    /// How many processes decode.
    [[nodiscard]] std::size_t running() const;
    /// That of one, for tests that end it; 0: none.
    [[nodiscard]] pid_t processOf(ObjectId movie) const;
    [[nodiscard]] std::uint64_t requests() const { return requests_; }
    /// s; 0: not known (yet), or there is no such Movie. It stays known while its file is the same.
    [[nodiscard]] double lengthOf(ObjectId movie) const;

private:
    /// Of one Movie.
    struct Reel;
    void look(const Aspect& scene, ObjectId id, bool again);
    void forget(ObjectId id);
    void attend(const Movie& movie, ObjectId id, Reel& reel, TimePoint now);
    void open(const Movie& movie, ObjectId id, Reel& reel);
    void take(Reel& reel, std::vector<FilmFrame> frames);
    void ask(const Movie& movie, Reel& reel, TimePoint now);
    void failed(ObjectId id, Reel& reel, const std::string& problem);
    void advance(const Aspect& scene, const Movie& movie, Reel& reel, double seconds);
    void show(const Image& image, ObjectId id, const FilmFrame& frame, ChangeListBuilder& edits) const;

    Opener open_;
    std::string program_;
    Duration patience_;
    std::map<ObjectId, Reel> reels_;
    std::vector<std::future<Expected<FileHandle>>> left_;  ///< of films that nobody wants any more
    std::vector<std::string> remarks_;
    std::uint64_t requests_ = 0;
};

}  // namespace tessera
