/* A job type of Flamenco: put it into the folder `scripts` beside flamenco-manager. The page docs/farm.md explains it. */

const JOB_TYPE = {
    label: "Mesh-Free Laplacian: Files",
    description: "Process the point clouds of a folder in equal shares, and merge the reports",
    settings: [
        { key: "input_dir", type: "string", subtype: "dir_path", required: true,
          description: "Folder with the point clouds" },
        { key: "output_dir", type: "string", subtype: "dir_path", required: true,
          description: "Folder for the results; its folder reports gets a report of each task" },
        { key: "verb", type: "string", default: "analyze",
          description: "A verb of the command line with many inputs and outputs, such as analyze, thin-out or measure" },
        { key: "options", type: "string", default: "",
          description: "Further options, as typed in a shell, such as --modes 10 --format npz" },
        { key: "parts", type: "int32", default: 10,
          description: "How many tasks share the files" },
        { key: "program", type: "string", default: "meshfree",
          description: "How the command line is called on the workers; in Blender, {blender} --background --command meshfree" },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    const program = shellSplit(settings.program);
    if (!program.length) {
        throw new Error("The setting program is empty: say how the command line is called");
    }
    if (settings.parts < 1) {
        throw new Error("The setting parts is below 1: say how many tasks share the files");
    }
    const reports = path.join(settings.output_dir, "reports");
    const shares = [];
    for (let number = 1; number <= settings.parts; number++) {
        const task = author.Task(`part-${number}`, "misc");
        task.addCommand(command(program, [
            settings.verb, settings.input_dir,
            "--out-dir", settings.output_dir,
            "--part", `${number}/${settings.parts}`,
            "--skip-done",
            "--report", path.join(reports, `part-${number}.jsonl`),
            ...shellSplit(settings.options),
        ]));
        shares.push(task);
        job.addTask(task);
    }
    const report = author.Task("report", "misc");
    report.addCommand(command(program, ["report", reports, "--out", path.join(settings.output_dir, "report.csv")]));
    for (const task of shares) {
        report.addDependency(task);
    }
    job.addTask(report);
}

function command(program, args) {
    return author.Command("exec", { exe: program[0], args: [...program.slice(1), ...args] });
}
