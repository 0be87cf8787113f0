#include "server/movies/Movies.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "common/base/StartThread.h"
#include "common/base/Utf8.h"
#include "common/cores/Image.h"
#include "common/cores/Movie.h"
#include "common/scene/FieldTable.h"
#include "server/movies/Reel.h"

namespace tessera {
namespace {

constexpr std::size_t kMostMovieProblemBytes = 512;

bool isMovieColumn(const FieldColumn& column) {
    return column.type == typeOf<Movie>();
}

bool isReady(const std::future<Expected<FileHandle>>& future, Duration patience) {
    return future.wait_for(patience) == std::future_status::ready;
}

}  // namespace

Movies::Movies(Opener open, std::string program, Duration patience)
    : open_(std::move(open)), program_(std::move(program)), patience_(patience) {}
Movies::~Movies() = default;

void Movies::update(const Aspect& scene, const ChangeList* list) {
    if (!list) {
        for (const ObjectId id : std::vector<ObjectId>(scene.ids()))
            if (scene.get<Movie>(id)) look(scene, id, true);
        std::vector<ObjectId> gone;
        for (const auto& [id, reel] : reels_)
            if (!scene.get<Movie>(id)) gone.push_back(id);
        for (const ObjectId id : gone) forget(id);
        return;
    }
    for (const Creation& creation : list->creations)
        if (creation.type == typeOf<Movie>()) look(scene, creation.id, false);
    for (const FieldColumn& column : list->columns) {
        if (!isMovieColumn(column)) continue;
        const bool again = column.field == fieldId<&Movie::file> || column.field == fieldId<&Movie::playing>;
        for (const ObjectId id : column.ids) look(scene, id, again);
    }
    if (reels_.empty()) return;
    for (const ObjectId id : list->destructions) forget(id);
}

void Movies::look(const Aspect& scene, ObjectId id, bool again) {
    const Movie* movie = scene.get<Movie>(id);
    if (!movie) return;
    const auto [place, isNew] = reels_.try_emplace(id);
    Reel& reel = place->second;
    if (isNew || movie->file != reel.file) {
        reel.stop();
        if (reel.opening.valid()) left_.push_back(std::move(reel.opening));
        reel.state = Reel::State::kStill;
        reel.file = movie->file;
        reel.length = 0;
        reel.shown = false;
        reel.problem.clear();
        reel.written = reel.before = movie->time;
        reel.beginRun(movie->time);
    } else if (again && reel.state == Reel::State::kFailed) {
        // Whoever says it again wants it to be tried again.
        reel.state = Reel::State::kStill;
        reel.problem.clear();
    }
    if (movie->image != reel.image) {
        reel.image = movie->image;
        reel.shown = false;
        reel.beginRun(movie->time);
    }
}

void Movies::forget(ObjectId id) {
    const auto found = reels_.find(id);
    if (found == reels_.end()) return;
    if (found->second.opening.valid()) left_.push_back(std::move(found->second.opening));
    reels_.erase(found);
}

void Movies::failed(ObjectId id, Reel& reel, const std::string& problem) {
    reel.stop();
    reel.state = Reel::State::kFailed;
    reel.problem = cutUtf8(problem, kMostMovieProblemBytes);
    remarks_.push_back(fmt::format("Movie #{}: {}", id.value, reel.problem));
}

void Movies::attend(const Aspect& scene, TimePoint now) {
    std::erase_if(left_, [&](const auto& opening) { return isReady(opening, patience_); });
    for (auto& [id, reel] : reels_) {
        const Movie& movie = *scene.get<Movie>(id);
        reel.playable = !movie.file.empty() && scene.get<Image>(movie.image);
        if (reel.playable) attend(movie, id, reel, now);
    }
}

void Movies::open(const Movie& movie, ObjectId id, Reel& reel) {
    if (reel.state != Reel::State::kStill || !reel.wants(movie)) return;
    const auto busy = std::ranges::count_if(reels_, [](const auto& one) {
        return one.second.state == Reel::State::kOpening || one.second.state == Reel::State::kRunning;
    });
    // Who stands has its picture, and gives way; who has stood longest first.
    Reel* standing = nullptr;
    for (auto& [other, one] : reels_)
        if (one.state == Reel::State::kRunning && one.idle > 0 && (!standing || one.idle > standing->idle))
            standing = &one;
    if (static_cast<std::size_t>(busy) + left_.size() >= kMostFilms && standing) {
        standing->stop();
    } else if (static_cast<std::size_t>(busy) + left_.size() >= kMostFilms) {
        if (reel.problem.empty())
            remarks_.push_back(
                fmt::format("Movie #{} waits: {} films are decoded at once already", id.value, kMostFilms));
        reel.problem = fmt::format("it waits: {} films are decoded at once already", kMostFilms);
        return;
    }
    try {
        reel.opening = std::async(std::launch::async, open_, movie.file);
    } catch (const std::system_error&) {
        reel.problem = fmt::format("it waits: {}", kNoThread);
        return;
    }
    reel.problem.clear();
    reel.state = Reel::State::kOpening;
}

void Movies::attend(const Movie& movie, ObjectId id, Reel& reel, TimePoint now) {
    open(movie, id, reel);
    if (reel.state == Reel::State::kOpening && isReady(reel.opening, patience_)) {
        Expected<FileHandle> film = reel.opening.get();
        // A child ends with the thread that started it: not there.
        Expected<FilmProcess> process =
            film ? FilmProcess::start(std::move(*film), program_) : tl::unexpected(film.error());
        if (!process) return failed(id, reel, process.error().message);
        reel.process.emplace(std::move(*process));
        reel.state = Reel::State::kRunning;
        reel.idle = 0;
    }
    if (reel.state != Reel::State::kRunning) return;
    Expected<std::vector<FilmFrame>> frames = reel.process->poll(now, patience_);
    if (!frames) return failed(id, reel, frames.error().message);
    take(reel, std::move(*frames));
    ask(movie, reel, now);
}

void Movies::take(Reel& reel, std::vector<FilmFrame> frames) {
    for (FilmFrame& frame : frames) {
        const Reel::Asked asked = reel.asked.front();
        reel.asked.pop_front();
        const bool known = reel.length > 0;
        if (frame.seconds > 0 && std::abs(frame.seconds - reel.length) > 1e-9) {
            reel.length = frame.seconds;
            // Where the film begins again is elsewhere than what is ahead has been placed by.
            if (known && reel.base != 0) {
                reel.beginRun(reel.filmTime());
                continue;
            }
        }
        if (!asked.ofThisRun) continue;
        if (asked.exact)
            reel.lastBase = asked.base;
        else if (frame.wrapped)
            reel.lastBase += reel.length;
        reel.told = true;
        reel.lastBegin = frame.begin;
        reel.lastEnd = frame.end;
        const double begin = reel.lastBase + frame.begin;
        reel.held.push_back({.frame = std::move(frame), .exact = asked.exact, .begin = begin});
    }
}

void Movies::ask(const Movie& movie, Reel& reel, TimePoint now) {
    if (reel.process->underWay() >= FilmProcess::kMostUnderWay) return;
    const double time = reel.filmTime();
    const auto say = [&](bool exact, double seconds) {
        const std::uint32_t loop = movie.mode == Movie::kLoop ? FilmRequest::kLoop : 0;
        const std::uint64_t serial =
            reel.process->ask({.flags = exact ? 0 : FilmRequest::kFollowing | loop, .seconds = seconds}, now);
        reel.asked.push_back({.serial = serial, .exact = exact, .base = reel.base});
        if (exact) reel.exactlyAsked = seconds;
        ++requests_;
    };
    const auto ofThisRun = static_cast<std::size_t>(std::ranges::count(reel.asked, true, &Reel::Asked::ofThisRun));
    if (!reel.told) {
        if (ofThisRun == 0) say(true, time);
        return;
    }
    if (reel.direction <= 0) {
        if (ofThisRun == 0 && !reel.covered() && reel.exactlyAsked != time && reel.held.empty()) say(true, time);
        return;
    }
    if (reel.held.size() + ofThisRun >= kMostAhead) return;
    const bool onePicture = reel.lastIsTheEnd() && reel.lastBegin <= 0;
    if (reel.lastIsTheEnd() && (onePicture || movie.mode == Movie::kOnce)) return;
    // Far behind, as of a great speed: not what follows, but what is due.
    constexpr double kFar = 0.5;
    const double late = reel.clock - (reel.lastBase + reel.lastEnd);
    if (late > kFar) {
        if (ofThisRun == 0) say(true, time);
    } else {
        say(false, reel.clock - reel.lastBase);
    }
}

std::vector<ChangeList> Movies::advance(const Aspect& scene, double seconds, TimePoint now) {
    std::vector<ChangeList> lists;
    if (reels_.empty()) return lists;
    attend(scene, now);
    std::map<ObjectId, ObjectId> writers;
    for (auto& [id, reel] : reels_) {
        const Movie& movie = *scene.get<Movie>(id);
        ChangeListBuilder edits;
        std::string problem = movie.file.empty() ? "it names no file"
                              : !reel.playable   ? "it names no image"
                                                 : reel.problem;
        // Edits that say so are refused; what undo brings back, or a large load, may.
        if (const auto [first, alone] = writers.emplace(movie.image, id); !alone && reel.playable) {
            problem = fmt::format("Movie #{} writes its image already", first->second.value);
            reel.playable = false;
        }
        if (movie.problem != problem) setField<&Movie::problem>(edits, id, problem);
        if (!reel.playable && reel.process) reel.stop();
        advance(scene, movie, reel, seconds);
        if (reel.shown && reel.written != movie.time) setField<&Movie::time>(edits, id, reel.written);
        // The newest that is due.
        auto due = reel.held.end();
        for (auto held = reel.held.begin(); held != reel.held.end(); ++held)
            if (held->exact || held->begin <= reel.clock + 1e-9) due = held;
        if (due != reel.held.end() && reel.playable) {
            show(*scene.get<Image>(movie.image), movie.image, due->frame, edits);
            reel.shown = true;
            reel.shownBegin = due->frame.begin;
            reel.shownEnd = due->frame.end;
            reel.held.erase(reel.held.begin(), due + 1);
        }
        if (!edits.empty()) lists.push_back(edits.take());
        if (!reel.process) continue;
        reel.idle = reel.wants(movie) || !reel.asked.empty() ? 0 : reel.idle + 1;
        if (reel.idle > kPatience) reel.stop();
    }
    return lists;
}

void Movies::advance(const Aspect&, const Movie& movie, Reel& reel, double seconds) {
    const int direction = !movie.playing || movie.speed == 0 ? 0 : movie.speed > 0 ? 1 : -1;
    const bool sought = movie.time != reel.written && movie.time != reel.before;
    if (sought || (direction != reel.direction && (direction < 0 || reel.direction < 0))) reel.beginRun(movie.time);
    reel.direction = direction;
    // The clock begins with the first picture, and stands where none comes any more.
    if (!sought && direction != 0 && reel.shown && reel.state != Reel::State::kFailed && reel.playable)
        reel.clock += movie.speed * seconds;
    reel.fold(movie.mode);
    reel.before = movie.time;
    reel.written = reel.filmTime();
}

void Movies::show(const Image& image, ObjectId id, const FilmFrame& frame, ChangeListBuilder& edits) const {
    const bool sameSize = image.pixels.resident() && image.pixels.sizeBytes() == frame.pixels.sizeBytes();
    if (sameSize) {
        const ByteSpan now = image.pixels.bytes(), next = frame.pixels.bytes();
        const auto first = static_cast<std::size_t>(std::ranges::mismatch(now, next).in1 - now.begin());
        std::size_t end = now.size();
        while (end > first && now[end - 1] == next[end - 1]) --end;
        // Whole numbers, so that who follows ranges sees pixels and blocks.
        const std::size_t begin = first / 16 * 16;
        end = std::min(now.size(), (end + 15) / 16 * 16);
        if (begin < end)
            edits.setRange(id, typeOf<Image>(), fieldId<&Image::pixels>, begin,
                           Blob::of(next.subspan(begin, end - begin)));
    } else {
        setField<&Image::pixels>(edits, id, frame.pixels);
    }
    if (image.widthPx != frame.widthPx) setField<&Image::widthPx>(edits, id, frame.widthPx);
    if (image.heightPx != frame.heightPx) setField<&Image::heightPx>(edits, id, frame.heightPx);
    if (image.encoding != frame.encoding) setField<&Image::encoding>(edits, id, frame.encoding);
    if (image.mipmaps != frame.mipmaps) setField<&Image::mipmaps>(edits, id, frame.mipmaps);
    if (image.shape != Image::kFlat) setField<&Image::shape>(edits, id, Image::kFlat);
    if (image.depthPx != 1) setField<&Image::depthPx>(edits, id, std::int64_t{1});
}

std::size_t Movies::awaited() const {
    return static_cast<std::size_t>(std::ranges::count_if(reels_, [](const auto& one) {
        const Reel& reel = one.second;
        return reel.playable && !reel.shown && reel.held.empty() && reel.problem.empty() &&
               reel.state != Reel::State::kFailed;
    }));
}

std::size_t Movies::running() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(reels_, [](const auto& one) { return one.second.process.has_value(); }));
}

pid_t Movies::processOf(ObjectId movie) const {
    const auto found = reels_.find(movie);
    return found != reels_.end() && found->second.process ? found->second.process->process() : 0;
}

double Movies::lengthOf(ObjectId movie) const {
    const auto found = reels_.find(movie);
    return found != reels_.end() ? found->second.length : 0;
}

}  // namespace tessera
