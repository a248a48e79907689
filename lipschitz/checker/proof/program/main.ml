(* swarmcert-check-proved: the command line. *)

open Refusal

let help =
  "Verify a certificate against the weights with a checker that is proved in Coq\n\
   Usage: swarmcert-check-proved [--coq] [OPTIONS] CERTIFICATE [NET]\n\
  \       swarmcert-check-proved --many [OPTIONS] [NET]\n\n\
   NET is a network.toml, or a weight file that holds one plain network; or instead of it\n\
  \  --phi FILE --rho FILE   phi and rho\n\
  \  --key KEY               key of the state dict inside a nested checkpoint\n\
  \  --order A,B,C           layers in the order of evaluation; with --phi and --rho phi=A,B and rho=A,B\n\
  \  --activation OP,...     what lies between the layers, where neither the weight files nor network.toml say \
      it; without it,\n\
  \                          the certificate says it\n\
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

let rec options (args : Network.arguments) mode positional = function
  | [] -> args, mode, List.rev positional
  | ("-h" | "--help") :: _ -> print_string help; exit 0
  | "--version" :: _ -> print_endline Version.text; exit 0
  | "--coq" :: rest -> options args Coq_file positional rest
  | "--many" :: rest -> options args Many positional rest
  | ("-q" | "--quiet") :: rest -> options args mode positional rest
  | "--phi" :: file :: rest -> options { args with phi = file } mode positional rest
  | "--rho" :: file :: rest -> options { args with rho = file } mode positional rest
  | "--key" :: key :: rest -> options { args with key } mode positional rest
  | "--activation" :: activation :: rest ->
    let known name = if Piecewise.called name = None then
        raise (Usage ("--activation: there is no activation " ^ shown name)) in
    List.iter known (String.split_on_char ',' activation);
    options { args with activation } mode positional rest
  | "--order" :: word :: rest ->
    let part, names = match String.index_opt word '=' with
      | Some at -> String.sub word 0 at, String.sub word (at + 1) (String.length word - at - 1)
      | None -> "network", word in
    options { args with orders = (part, String.split_on_char ',' names) :: args.orders } mode positional rest
  | word :: _ when String.length word > 1 && word.[0] = '-' ->
    raise (Usage ("unknown option, or one without its value: " ^ word))
  | word :: rest -> options args mode (word :: positional) rest

let schema_of path = function
  | Json.Object members ->
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

let check_file net path =
  let json = Json.parse path (contents path) in
  schema_of path json;
  Certificate.check net json

(* Exit code and message of an exception. *)
let failure = function
  | Rejected reason -> 1, "rejected: " ^ reason
  | Usage reason -> 2, reason
  | Bad_input reason -> 3, reason
  | Out_of_memory | Stack_overflow -> 3, "the files are too large for this checker"
  | fault -> 70, "internal fault: " ^ Printexc.to_string fault

let check_many net =
  let decide path = match check_file net path with
    | state -> if state.Claims.not_checked = [] then 0, "accepted" else 4, "inconclusive"
    | exception fault -> failure fault in
  try
    while true do
      let code, words = decide (input_line stdin) in
      Printf.printf "%d\t%s\n%!" code (String.map (fun c -> if c = '\n' then ' ' else c) words)
    done; 0
  with End_of_file -> 0

(* The certificate is read before the weights: it is the first file that is named. *)
let single args mode certificate =
  let json = Json.parse certificate (contents certificate) in
  schema_of certificate json;
  let net = Network.read args in
  let state = Certificate.check net json in
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
  let empty = { Network.net = ""; phi = ""; rho = ""; key = ""; orders = []; activation = "" } in
  let args, mode, positional = options empty Report [] (List.tl (Array.to_list Sys.argv)) in
  let has_pair = args.phi <> "" && args.rho <> "" and has_none = args.phi = "" && args.rho = "" in
  match mode, positional with
  | Many, [ net ] when has_none -> check_many (Network.read { args with net })
  | Many, [] when has_pair -> check_many (Network.read args)
  | Many, _ -> raise (Usage "expected NET, or --phi FILE --rho FILE")
  | _, ([ _; _ ] as words) when has_none -> single { args with net = List.nth words 1 } mode (List.hd words)
  | _, [ certificate ] when has_pair -> single args mode certificate
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
