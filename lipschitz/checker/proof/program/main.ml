(* swarmcert-check-proved: the command line. *)

open Refusal

let help =
  "Verify a certificate with a checker that is proved in Coq\n\
   Usage: swarmcert-check-proved [--coq] CERTIFICATE NET\n\
  \       swarmcert-check-proved [--coq] CERTIFICATE --phi FILE --rho FILE\n\
  \       swarmcert-check-proved --many NET\n\n\
   The network is read from the certificate. NET, a network.toml or a weight file, must have the hashes that the \
      certificate\nnames; that it holds this network is for swarmcert check to say.\n\n\
  \  --coq                   write the certificate as a Coq file to standard output; coqc then accepts it in \
      its kernel\n\
  \  --many                  certificates of one NET, named on standard input, one in a line; writes the exit \
      code and a\n\
  \                          tab and the reason of each in a line\n\
  \  --version               the program's version\n\n\
   Exit codes: 0 accepted; 1 rejected, with the reason; 2 usage; 3 a file cannot be read; 4 what was checked holds, \
    but some\n\
   claims are beyond this checker and are listed as \"not checked\".\n"

exception Usage of string

type mode = Report | Coq_file | Many

type arguments = { phi : string; rho : string; mode : mode; positional : string list (* the last one first *) }

let rec options args = function
  | [] -> { args with positional = List.rev args.positional }
  | ("-h" | "--help") :: _ -> print_string help; exit 0
  | "--version" :: _ -> print_endline Version.text; exit 0
  | "--coq" :: rest -> options { args with mode = Coq_file } rest
  | "--many" :: rest -> options { args with mode = Many } rest
  | ("-q" | "--quiet") :: rest -> options args rest
  | "--phi" :: file :: rest -> options { args with phi = file } rest
  | "--rho" :: file :: rest -> options { args with rho = file } rest
  | word :: _ when String.length word > 1 && word.[0] = '-' ->
    raise (Usage ("unknown option, or one without its value: " ^ word))
  | word :: rest -> options { args with positional = word :: args.positional } rest

let schema_of path = function
  | Json.Object members ->
    if List.assoc_opt "schema" members = Some (Json.Text Statement.old_schema) then
      bad_input "%s: is older than this program and does not carry the network: renew it with swarmcert certify" path;
    if List.assoc_opt "schema" members <> Some (Json.Text Statement.schema) then
      bad_input "%s: schema must be \"%s\": is this the right file?" path Statement.schema
  | _ -> bad_input "%s: is not a JSON object" path

let report (state : Claims.t) =
  let values = if state.values > 0 then Printf.sprintf ", values of %d" state.values else "" in
  let numbers = Printf.sprintf "%d spectral norms, %d upper bounds, %d lower bounds%s" state.spectral_norms
      state.upper_bounds state.lower_bounds values in
  List.iter (fun what -> Printf.printf "not checked: %s\n" what) (List.rev state.not_checked);
  (match List.length state.not_checked with
   | 0 -> Printf.printf "accepted: every statement verified in exact arithmetic: %s\n" numbers
   | n -> Printf.printf "inconclusive: what was checked holds: %s; %d not checked\n" numbers n);
  Printf.printf "for %s\n" (Functions.words state.net);
  if state.not_checked = [] then 0 else 4

let check_file files path =
  let json = Json.parse path (contents path) in
  schema_of path json;
  Certificate.check files json

(* Exit code and message of an exception. *)
let failure = function
  | Rejected reason -> 1, "rejected: " ^ reason
  | Usage reason -> 2, reason
  | Bad_input reason -> 3, reason
  | Out_of_memory | Stack_overflow -> 3, "the files are too large for this checker"
  | fault -> 70, "internal fault: " ^ Printexc.to_string fault

let check_many files =
  let decide path = match check_file files path with
    | state -> if state.Claims.not_checked = [] then 0, "accepted" else 4, "inconclusive"
    | exception fault -> failure fault in
  try
    while true do
      let code, words = decide (input_line stdin) in
      Printf.printf "%d\t%s\n%!" code (String.map (fun c -> if c = '\n' then ' ' else c) words)
    done; 0
  with End_of_file -> 0

let single files mode certificate =
  let state = check_file files certificate in
  if mode = Coq_file then begin
    print_string (Kernel.file state.parts (List.rev state.log));
    List.iter (fun what -> prerr_endline ("not checked: " ^ what)) (List.rev state.not_checked);
    if state.unwritten > 0 then
      Printf.eprintf "not written: %d claims by parts of boxes, which hold but are not in the Coq file\n"
        state.unwritten;
    if state.not_checked = [] && state.unwritten = 0 then 0 else 4
  end
  else report state

let run () =
  let empty = { phi = ""; rho = ""; mode = Report; positional = [] } in
  let args = options empty (List.tl (Array.to_list Sys.argv)) in
  let has_pair = args.phi <> "" && args.rho <> "" and has_none = args.phi = "" && args.rho = "" in
  match args.mode, args.positional with
  | Many, [ net ] when has_none -> check_many (Network.Described net)
  | Many, [] when has_pair -> check_many (Network.Pair (args.phi, args.rho))
  | Many, _ -> raise (Usage "expected NET, or --phi FILE --rho FILE")
  | mode, [ certificate; net ] when has_none -> single (Network.Described net) mode certificate
  | mode, [ certificate ] when has_pair -> single (Network.Pair (args.phi, args.rho)) mode certificate
  | _ -> raise (Usage "expected CERTIFICATE NET, or CERTIFICATE --phi FILE --rho FILE")

let () =
  let code = match run () with
    | code -> code
    | exception fault ->
      let code, words = failure fault in
      (match code with
       | 1 -> print_endline words
       | 2 -> Printf.eprintf "swarmcert-check-proved: %s\nTry --help\n" words
       | _ -> Printf.eprintf "swarmcert-check-proved: %s\n" words);
      code in
  exit code
