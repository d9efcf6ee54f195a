// polestar batch: textures times targets times frames from one job file, here or on a farm.

#include <xxhash.h>

#include <fnmatch.h>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <set>

#include "batch/local_run.h"
#include "batch/open_job.h"
#include "batch/report.h"
#include "batch/slurm.h"
#include "batch/task_state.h"
#include "cli/command_line.h"
#include "cli/outputs.h"
#include "cli/text.h"
#include "commands.h"
#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;
using batch::Plan;
using batch::Task;
using batch::TaskResult;
using batch::TaskState;
using Tasks = std::vector<std::size_t>;

/// "2/5": the second of five.
struct Shard {
  std::size_t number = 1, count = 1;

  static Shard parse(const std::string& text) {
    Shard shard;
    const char* end = text.data() + text.size();
    const auto first = std::from_chars(text.data(), end, shard.number);
    const auto second = first.ptr == end || *first.ptr != '/'
                            ? std::from_chars_result{end, std::errc::invalid_argument}
                            : std::from_chars(first.ptr + 1, end, shard.count);
    if (first.ec != std::errc() || second.ec != std::errc() || second.ptr != end || shard.number < 1 ||
        shard.number > shard.count) {
      throw Error(Errc::usage, "--shard is I/N, from 1/N to N/N; found " + text);
    }
    return shard;
  }
};

void writeText(const fs::path& path, const std::string& text) {
  writeAtomically(path, [&](const fs::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out << text << std::flush;
    if (!out) throw Error(Errc::io, "cannot write " + path.string() + "; is the disk full?");
  });
}

/// Tasks run as commands of this very process's forks.
int runWords(const std::vector<std::string>& words) { return runCommandLine(makeCommands(), words); }

class BatchCommand final : public Command {
 public:
  Description description() const override {
    return {"batch",
            "Textures times targets times frames: map, transfer and render all of them, here or on a farm",
            "With --submit print or openjd, the file to write; default standard output",
            "polestar batch jobs.toml --sheet sheet.png",
            /*ownThreads=*/true};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("JOBS", jobs_, "A job file, .toml; or a plan that --submit wrote, .json")
        ->required()
        ->type_name("");
    app.add_option(
           "--only", only_,
           "Do what is named so, with all it needs: kiwi/bennu, 'kiwi/*', '*/bennu'; may be given often")
        ->type_name("PATTERN")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--shard", shard_, "Do the I-th of N parts, with all it needs: one each on N machines")
        ->type_name("I/N");
    CLI::Option* task =
        app.add_option("--task", task_, "Do one task of a plan by its number; its needs are made elsewhere")
            ->type_name("NUMBER");
    app.add_option("--at-once", options_.atOnce, "Most tasks at a time; default as many as threads (-j)")
        ->check(CLI::Range(1, 4096).description(""))
        ->type_name("N");
    app.add_option(
           "--retries", retries_,
           "How often a task is tried again after a crash or an error of files; default that of the job "
           "file, else 1")
        ->check(CLI::Range(0, 100).description(""))
        ->type_name("N");
    CLI::Option* status =
        app.add_flag("--status", status_, "Say what is done and what failed, and do nothing");
    app.add_option("--sheet", sheet_, "Put all pictures on one, with names: a .png or .jpg")
        ->type_name("FILE");
    app.add_option(
           "--submit", submit_,
           "Hand the tasks over instead of running them: slurm submits job arrays, print writes a command "
           "a line, openjd a template of the Open Job Description")
        ->check(CLI::IsMember({"slurm", "print", "openjd"}).description(""))
        ->type_name("FARM")
        ->excludes(task)
        ->excludes(status);
    app.add_flag("--wait", wait_,
                 "With --submit slurm: wait for the end, submit again what may be tried again, and report");
  }

  void run(Session& session) override {
    checkArguments(session);
    load(session);
    checkTasks();
    const Tasks selection = select();
    if (session.options().dryRun) return describe(selection, session);
    if (status_) return report(selection, batch::collectResults(plan_, selection), session);
    if (submit_.empty()) return runHere(selection, session);
    makeFolder(plan_.folder / plan_.output);
    // What is done already needs no place in a queue.
    const Tasks open = staleOf(selection);
    if (submit_ == "slurm") return submitSlurm(selection, open, session);
    writeForFarm(open, session);
  }

 private:
  void checkArguments(Session& session) {
    if (wait_ && submit_ != "slurm") throw Error(Errc::usage, "--wait is for --submit slurm");
    if (task_ && (!only_.empty() || !shard_.empty()))
      throw Error(Errc::usage, "--task names one task; leave --only and --shard out");
    const bool writes = submit_ == "print" || submit_ == "openjd";
    if (!session.options().output.empty() && !writes) {
      throw Error(
          Errc::usage,
          "-o is for --submit print or openjd; the folder of results is named in the job file (output)");
    }
    if (writes && session.options().json)
      throw Error(Errc::usage, "--submit " + submit_ + " writes its own; drop --json");
    if (!shard_.empty()) Shard::parse(shard_);
    session.addInput(jobs_);
    if (!session.options().output.empty())
      checkOutput(session.options().output, session.options().overwrite, session.inputs());
    if (!sheet_.empty()) checkOutput(sheet_, /*overwrite=*/true, session.inputs());
    // Where tasks change folders these must not.
    if (!sheet_.empty()) sheet_ = fs::absolute(sheet_);
  }

  void load(Session& session) {
    if (jobs_.extension() == ".json") {
      plan_ = batch::readPlan(jobs_);
    } else {
      const batch::JobFile job = batch::readJobFile(jobs_);
      plan_ = batch::makePlan(job);
      slurm_ = job.slurm;
    }
    options_.threads = session.options().threads;
    options_.retries = retries_.value_or(plan_.retries);
    if (task_ && *task_ >= plan_.tasks.size()) {
      throw Error(Errc::usage, "there is no task " + std::to_string(*task_) + "; the plan has " +
                                   counted(plan_.tasks.size(), "task", "tasks") + ", from 0 on");
    }
  }

  /// That every task could be run, before any is. Most differ in names alone.
  void checkTasks() const {
    std::set<std::vector<std::string>> seen;
    for (const Task& task : plan_.tasks) {
      std::vector<std::string> options;
      std::copy_if(task.arguments.begin(), task.arguments.end(), std::back_inserter(options),
                   [](const std::string& word) { return word.starts_with("--"); });
      options.push_back(batch::toString(task.step));
      if (!seen.insert(options).second) continue;
      if (const auto why = whyNoCommandLine(makeCommands(), task.arguments))
        throw Error(Errc::usage, jobs_.string() + ": " + task.label() + ": " + *why);
    }
  }

  Tasks select() const {
    if (task_) return {*task_};
    Tasks chosen;
    if (only_.empty()) {
      chosen = plan_.ends();
    } else {
      for (std::size_t i = 0; i < plan_.tasks.size(); ++i) {
        if (std::any_of(only_.begin(), only_.end(), [&](const std::string& pattern) {
              return fnmatch(pattern.c_str(), plan_.tasks[i].name.c_str(), 0) == 0;
            }))
          chosen.push_back(i);
      }
      if (chosen.empty())
        throw Error(Errc::usage, "nothing is named " + only_.front() + "; --dry-run lists what there is");
    }
    if (!shard_.empty()) {
      const Shard shard = Shard::parse(shard_);
      Tasks part;
      for (std::size_t i = shard.number - 1; i < chosen.size(); i += shard.count) part.push_back(chosen[i]);
      chosen = part;
    }
    return plan_.withNeeds(chosen);
  }

  Tasks staleOf(const Tasks& selection) const {
    std::vector<bool> stale(plan_.tasks.size(), false);
    Tasks result;
    for (const std::size_t i : selection) {
      const auto& after = plan_.tasks[i].after;
      stale[i] = std::any_of(after.begin(), after.end(), [&](std::size_t other) { return stale[other]; }) ||
                 batch::whyStale(plan_, plan_.tasks[i]).has_value();
      if (stale[i]) result.push_back(i);
    }
    return result;
  }

  void describe(const Tasks& selection, Session& session) const {
    const Tasks open = staleOf(selection);
    Json tasks = Json::array();
    for (const std::size_t i : selection) {
      const bool todo = std::binary_search(open.begin(), open.end(), i);
      const std::string line = commandLine(plan_.tasks[i].arguments);
      tasks.push_back({{"index", i}, {"task", plan_.tasks[i].label()}, {"to_do", todo}, {"command", line}});
      session.text() += (todo ? "would run  " : "up to date ") + line + "\n";
    }
    session.json()["dry_run"] = {{"folder", plan_.folder.string()}, {"tasks", tasks}};
    session.text() += counted(open.size(), "task", "tasks") + " to do, " +
                      grouped(selection.size() - open.size()) + " up to date, in " + plan_.folder.string() +
                      "\n";
  }

  static void makeFolder(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw Error(Errc::io, "cannot make the folder " + folder.string() + ": " + error.message());
  }

  void runHere(const Tasks& selection, Session& session) {
    makeFolder(plan_.folder / plan_.output);
    batch::RunOptions options = options_;
    options.needsAreElsewhere = task_.has_value();
    std::size_t settled = 0;
    const auto show = [&](const batch::RunCounts& counts) {
      settled = counts.settled();
      session.showStatus(batch::overviewLine(counts));
    };
    std::vector<TaskResult> results;
    try {
      results = session.timed("run", [&] {
        return batch::runLocally(plan_, selection, runWords, options, session.context(), show);
      });
    } catch (const Error& error) {
      if (error.code() != Errc::cancelled) throw;
      throw CommandFailure(failureFor(Errc::cancelled),
                           "cancelled; " + grouped(settled) + " of " +
                               counted(selection.size(), "task", "tasks") +
                               " were settled, the same command goes on from there");
    }
    if (task_) return endTask(results[*task_], session);
    report(selection, results, session);
  }

  /// A farm sees of a task what its command would say.
  void endTask(const TaskResult& result, Session& session) const {
    const Task& task = plan_.tasks[*task_];
    session.json()["report"] = batch::reportJson(plan_, {*task_}, resultsOf(result));
    session.text() = task.label() + ": " + batch::toString(result.state) + "\n";
    if (result.state == TaskState::failed) {
      const int code = result.exitCode > 0 ? result.exitCode : 1;
      throw CommandFailure({code, kTasksFailed.name}, task.label() + ": " + result.error +
                                                          "; log: " + (plan_.folder / task.log).string());
    }
  }

  std::vector<TaskResult> resultsOf(const TaskResult& result) const {
    std::vector<TaskResult> results(plan_.tasks.size());
    results[*task_] = result;
    return results;
  }

  void report(const Tasks& selection, const std::vector<TaskResult>& results, Session& session) const {
    const Json json = batch::reportJson(plan_, selection, results);
    session.json()["report"] = json;
    session.text() = jobs_.string() + "\n" + batch::reportText(plan_, selection, results);
    const fs::path file = plan_.folder / plan_.output / "report.json";
    if (!status_) {
      try {
        writeText(file, json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
      } catch (const Error& error) {
        session.context().log(LogLevel::warning, std::string("the report: ") + error.what());
      }
    }
    if (!sheet_.empty()) {
      if (!batch::writeSheet(sheet_, plan_, results))
        session.context().log(LogLevel::warning, "the sheet has no names: there is no font DejaVu Sans");
      session.text() += "wrote " + sheet_.string() + "\n";
    }
    const std::size_t failed = batch::countFailed(selection, results);
    if (failed == 0) return;
    const auto first = std::find_if(selection.begin(), selection.end(), [&](std::size_t i) {
      return results[i].state == TaskState::failed || results[i].state == TaskState::skipped;
    });
    throw CommandFailure(kTasksFailed, counted(failed, "task", "tasks") + " of " + grouped(selection.size()) +
                                           " failed or were skipped, first " + plan_.tasks[*first].label() +
                                           "; mend the cause and run the same again");
  }

  /// The plan as it is now, under a name of its own: tasks in a queue must not be renumbered by a later one.
  fs::path writePlan() const {
    const std::string text = batch::toJson(plan_).dump(1) + "\n";
    char hash[17];
    std::snprintf(hash, sizeof hash, "%016llx",
                  static_cast<unsigned long long>(XXH3_64bits(text.data(), text.size())));
    const fs::path file = farmFolder() / ("plan-" + std::string(hash) + ".json");
    writeText(file, text);
    return file;
  }

  fs::path farmFolder() const {
    const fs::path folder = plan_.folder / plan_.output / "farm";
    makeFolder(folder);
    return folder;
  }

  void writeForFarm(const Tasks& open, Session& session) const {
    if (open.empty()) throw Error(Errc::usage, "nothing is left to do: all tasks are up to date");
    const fs::path plan = writePlan();
    const std::string text =
        submit_ == "print" ? batch::commandLines(plan_, open, plan)
                           : batch::openJobTemplate(plan_, open, jobs_.stem().string(), plan).dump(2) + "\n";
    const fs::path& output = session.options().output;
    if (output.empty() || isStandardStream(output)) {
      session.text() = text;
    } else {
      writeText(output, text);
      session.text() = "wrote " + output.string() + ": " + counted(open.size(), "task", "tasks") + "\n";
    }
  }

  fs::path submissionFile() const { return farmFolder() / "submission.json"; }

  /// Two arrays of the same tasks would only wait for each other.
  void refuseSecondSubmission() const {
    std::ifstream in(submissionFile());
    const Json before = Json::parse(in, nullptr, /*allow_exceptions=*/false);
    if (!before.is_object()) return;
    std::vector<std::string> ids;
    for (const Json& job : before.value("jobs", Json::array())) ids.push_back(job.value("id", ""));
    const std::vector<std::string> unfinished = batch::unfinishedJobs(ids);
    if (unfinished.empty()) return;
    std::string list;
    for (const std::string& id : unfinished) list += (list.empty() ? "" : " ") + id;
    throw Error(Errc::io, "the tasks are in the queue already, as the jobs " + list +
                              "; wait for them, or give them up with: scancel " + list);
  }

  std::vector<batch::SlurmJob> submitOnce(const Tasks& open, const fs::path& plan, Session& session) const {
    const auto jobs =
        batch::submitToSlurm(plan_, open, slurm_, plan, farmFolder(), fs::read_symlink("/proc/self/exe"));
    Json list = Json::array();
    for (const batch::SlurmJob& job : jobs) {
      list.push_back({{"id", job.id}, {"step", batch::toString(job.step)}, {"tasks", job.tasks.size()}});
      session.context().log(LogLevel::info, "job " + job.id + ": " +
                                                counted(job.tasks.size(), "task", "tasks") + " of " +
                                                batch::toString(job.step));
    }
    writeText(submissionFile(), Json({{"plan", plan.string()}, {"jobs", list}}).dump(1) + "\n");
    session.json()["submitted"].insert(session.json()["submitted"].end(), list.begin(), list.end());
    return jobs;
  }

  void submitSlurm(const Tasks& selection, Tasks open, Session& session) const {
    session.json()["submitted"] = Json::array();
    if (!open.empty()) {
      refuseSecondSubmission();
      const fs::path plan = writePlan();
      auto jobs = submitOnce(open, plan, session);
      if (!wait_) {
        session.text() =
            counted(open.size(), "task", "tasks") + " in " + counted(jobs.size(), "job", "jobs") +
            " of Slurm; what came of them: polestar batch " + shellQuoted(jobs_.string()) + " --status\n";
        return;
      }
      // A task that fails is tried again by itself; what is open after that was lost with its node or job.
      for (int attempt = 0;; ++attempt) {
        waitForJobs(jobs, session);
        open = staleOf(selection);
        const auto results = batch::collectResults(plan_, selection);
        std::erase_if(open, [&](std::size_t i) { return hopeless(i, results); });
        if (open.empty() || attempt == options_.retries) break;
        session.context().log(LogLevel::warning, counted(open.size(), "task", "tasks") + " submitted again");
        jobs = submitOnce(open, plan, session);
      }
    }
    report(selection, withLost(selection, batch::collectResults(plan_, selection)), session);
  }

  void waitForJobs(const std::vector<batch::SlurmJob>& jobs, Session& session) const {
    try {
      showJobs(jobs, session);
    } catch (const Error& error) {
      if (error.code() != Errc::cancelled) throw;
      throw CommandFailure(failureFor(Errc::cancelled),
                           "cancelled; the jobs go on, what came of them: polestar batch " +
                               shellQuoted(jobs_.string()) + " --status");
    }
  }

  static void showJobs(const std::vector<batch::SlurmJob>& jobs, Session& session) {
    session.timed("wait", [&] {
      batch::waitForSlurm(jobs, session.context(),
                          [&](std::size_t pending, std::size_t running, std::size_t all) {
                            session.showStatus("Slurm: " + grouped(all - pending - running) + " of " +
                                               counted(all, "task", "tasks") + " over, " + grouped(running) +
                                               " running, " + grouped(pending) + " pending");
                          });
      return 0;
    });
  }

  /// Failed for good, or in need of something that did.
  bool hopeless(std::size_t task, const std::vector<TaskResult>& results) const {
    if (results[task].state == TaskState::failed) {
      const int code = results[task].exitCode;
      return code == 2 || (code >= 4 && code <= 7);
    }
    const auto& after = plan_.tasks[task].after;
    return std::any_of(after.begin(), after.end(),
                       [&](std::size_t other) { return hopeless(other, results); });
  }

  /// All jobs are over: what was not made was lost on the way.
  static std::vector<TaskResult> withLost(const Tasks& selection, std::vector<TaskResult> results) {
    for (const std::size_t i : selection) {
      if (results[i].state != TaskState::waiting) continue;
      results[i].state = TaskState::failed;
      results[i].error = "its job ended without a result: " + results[i].error;
    }
    return results;
  }

  fs::path jobs_, sheet_;
  std::vector<std::string> only_;
  std::string shard_, submit_;
  std::optional<std::size_t> task_;
  std::optional<int> retries_;
  bool status_ = false, wait_ = false;
  batch::RunOptions options_;
  batch::SlurmOptions slurm_;
  Plan plan_;
};

}  // namespace

std::unique_ptr<Command> makeBatchCommand() { return std::make_unique<BatchCommand>(); }

}  // namespace polestar::cli
