#pragma once
// The subcommands, one source file each.

#include <memory>

#include "cli/command.h"

namespace polestar::cli {

std::unique_ptr<Command> makeCheckCommand();
std::unique_ptr<Command> makeInfoCommand();

}  // namespace polestar::cli
