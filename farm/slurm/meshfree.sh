#!/bin/bash
# Process the point clouds of a folder in shares on Slurm, and merge the reports. The page docs/farm.md explains it.
#
#     bash meshfree.sh PARTS VERB INPUT_DIR OUTPUT_DIR [OPTION ...]
#
# MESHFREE names the program on the nodes, if not meshfree; SBATCH_... variables and #SBATCH lines say what a task gets.
#SBATCH --job-name=meshfree
#SBATCH --cpus-per-task=2
#SBATCH --mem=4G
#SBATCH --requeue
set -eu

if [ -z "${SLURM_ARRAY_TASK_ID:-}" ]; then # on the login node
    if [ "$#" -lt 4 ]; then
        sed -n 's/^#     //p' "$0" >&2
        exit 2
    fi
    parts=$1
    shift
    mkdir -p "$3/reports"
    job=$(sbatch --parsable --array="1-$parts" --output="$3/reports/part-%a.log" "$0" "$parts" "$@")
    sbatch --dependency="afterany:${job%%;*}" --job-name=meshfree-report --output="$3/reports/report.log" \
        --wrap="${MESHFREE:-meshfree} report $(printf '%q' "$3/reports") --out $(printf '%q' "$3/report.csv")"
    exit
fi

parts=$1 verb=$2 input=$3 output=$4
shift 4
export MESHFREE_CORES=${SLURM_CPUS_PER_TASK:-1} OPENBLAS_NUM_THREADS=1
read -ra program <<<"${MESHFREE:-meshfree}"
code=0
"${program[@]}" "$verb" "$input" --out-dir "$output" --part "$SLURM_ARRAY_TASK_ID/$parts" --skip-done \
    --report "$output/reports/part-$SLURM_ARRAY_TASK_ID.jsonl" "$@" || code=$?
if [ "$code" -eq 3 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt 3 ]; then # memory or disk: another node may have them
    scontrol requeue "$SLURM_JOB_ID"
fi
exit "$code"
