// Movies of scene text: films that are named, and read by nobody here.

#include <fmt/format.h>

#include <vector>

#include "common/cores/Movie.h"
#include "server/import/AssetFolders.h"
#include "server/import/SceneAssembly.h"
#include "server/import/TableCores.h"

namespace tessera {
namespace {

using MovieMessage = proto::scene::Movie;
static_assert(MovieMessage::ONCE == Movie::kOnce && MovieMessage::LOOP == Movie::kLoop);

}  // namespace

bool SceneAssembly::isFilm(LoadedFile& file, const std::string& name) {
    if (!file.films) {
        file.films.emplace();
        std::vector<const proto::scene::Node*> open;
        for (const proto::scene::Node& node : file.content.node()) open.push_back(&node);
        for (const proto::scene::Definition& definition : file.content.definition())
            for (const proto::scene::Node& node : definition.node()) open.push_back(&node);
        while (!open.empty()) {
            const proto::scene::Node& node = *open.back();
            open.pop_back();
            if (node.has_movie()) file.films->insert(node.movie().image());
            for (const proto::scene::Node& child : node.node()) open.push_back(&child);
        }
    }
    return file.films->contains(name);
}

Expected<ObjectId> SceneAssembly::movieCore(LoadedFile& file, const proto::scene::Movie& message) {
    if (const auto known = file.movieCores.find(&message); known != file.movieCores.end()) return known->second;
    if (!file.isScene) return fail(ErrorCode::kBadInput, "a model file may not play films");
    Expected<Movie> movie = readTableObject<Movie>(message);
    if (!movie) return tl::unexpected(movie.error());
    if (message.has_mode() && !MovieMessage::Mode_IsValid(message.mode())) return fail(ErrorCode::kBadInput, "a movie's mode is none of its words");
    if (movie->file.empty()) return fail(ErrorCode::kBadInput, "a movie names no file");
    if (message.image().empty()) return fail(ErrorCode::kBadInput, "a movie names no image to play into");
    Expected<std::string> path = pathBeside(movie->file, folderOf(file.path));
    if (!path) return tl::unexpected(path.error());
    movie->file = std::move(*path);
    noteNamed(file, movie->file);
    movie->playing = !message.paused();
    const Expected<ObjectId> image = imageCore(file, message.image());
    if (!image) return image;
    for (const auto& [other, core] : file.movieCores)
        if (other->image() == message.image()) return fail(ErrorCode::kBadInput, fmt::format("two movies play into the image '{}'; give each one of its own", readName(message.image(), "")));
    movie->image = *image;
    return file.movieCores[&message] = create(*movie);
}

}  // namespace tessera
