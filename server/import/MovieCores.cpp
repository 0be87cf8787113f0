#include "server/import/MovieCores.h"

#include <fmt/format.h>

#include <utility>

#include "common/cores/Movie.h"
#include "server/import/AssetFolders.h"
#include "server/import/TableCores.h"

namespace tessera {
namespace {

using MovieMessage = proto::scene::Movie;
static_assert(MovieMessage::ONCE == Movie::kOnce && MovieMessage::LOOP == Movie::kLoop);

}  // namespace

Expected<ObjectId> MovieCores::movie(LoadedFile& file, const MovieMessage& message) {
    auto& cores = cores_[&file];
    if (const auto known = cores.find(&message); known != cores.end()) return known->second;
    if (!file.isScene) return fail(ErrorCode::kBadInput, "a model file may not play films");
    Expected<Movie> movie = readTableObject<Movie>(message);
    if (!movie) return tl::unexpected(movie.error());
    if (message.has_mode() && !MovieMessage::Mode_IsValid(message.mode()))
        return fail(ErrorCode::kBadInput, "a movie's mode is none of its words");
    if (movie->file.empty()) return fail(ErrorCode::kBadInput, "a movie names no file");
    if (message.image().empty()) return fail(ErrorCode::kBadInput, "a movie names no image to play into");
    Expected<std::string> path = pathBeside(movie->file, folderOf(file.path));
    if (!path) return tl::unexpected(path.error());
    movie->file = std::move(*path);
    draft_.noteNamed(file, movie->file);
    movie->playing = !message.paused();
    const Expected<ObjectId> image = materials_.image(file, message.image());
    if (!image) return image;
    for (const auto& [other, core] : cores)
        if (other->image() == message.image())
            return fail(ErrorCode::kBadInput,
                        fmt::format("two movies play into the image '{}'; give each one of its own",
                                    readName(message.image(), "")));
    movie->image = *image;
    return cores[&message] = draft_.create(*movie);
}

}  // namespace tessera
