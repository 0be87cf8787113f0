/// What shells complete a program's words by, made of the same options that --help shows.
#pragma once

namespace CLI {
class App;
}

namespace tessera {

/// Gives a program the option `--completion SHELL` (bash, zsh or fish): parsing throws CLI::CallForVersion with the
/// script as its text. `app` is complete by the time it is parsed. Subcommands are completed with options of their own.
void addCompletion(CLI::App& app);

}  // namespace tessera
