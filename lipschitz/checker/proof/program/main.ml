(* swarmcert-check-proved: the command line. *)

open Refusal

let help =
  "Verify a certificate against the weights with a checker that is proved in Coq\n\
   Usage: swarmcert-check-proved [--coq] [OPTIONS] CERTIFICATE [NET]\n\n\
   NET is a network.toml, or a weight file that holds one plain network; or instead of it\n\
  \  --phi FILE --rho FILE   phi and rho\n\
  \  --key KEY               key of the state dict inside a nested checkpoint\n\
  \  --order A,B,C           layers in the order of evaluation; with --phi and --rho phi=A,B and rho=A,B\n\
  \  --coq                   write the certificate as a Coq file to standard output; coqc then accepts it in its kernel\n\
  \  --version               the program's version\n\n\
   Exit codes: 0 accepted; 1 rejected, with the reason; 2 usage; 3 a file cannot be read; 4 what was checked holds, but some\n\
   claims are beyond this checker and are listed as \"not checked\".\n"

exception Usage of string

let rec options (args : Network.arguments) coq positional = function
  | [] -> args, coq, List.rev positional
  | ("-h" | "--help") :: _ -> print_string help; exit 0
  | "--version" :: _ -> print_endline Version.text; exit 0
  | "--coq" :: rest -> options args true positional rest
  | ("-q" | "--quiet") :: rest -> options args coq positional rest
  | "--phi" :: file :: rest -> options { args with phi = file } coq positional rest
  | "--rho" :: file :: rest -> options { args with rho = file } coq positional rest
  | "--key" :: key :: rest -> options { args with key } coq positional rest
  | "--order" :: word :: rest ->
    let part, names = match String.index_opt word '=' with
      | Some at -> String.sub word 0 at, String.sub word (at + 1) (String.length word - at - 1)
      | None -> "network", word in
    options { args with orders = (part, String.split_on_char ',' names) :: args.orders } coq positional rest
  | word :: _ when String.length word > 1 && word.[0] = '-' -> raise (Usage ("unknown option, or one without its value: " ^ word))
  | word :: rest -> options args coq (word :: positional) rest

let schema_of path = function
  | Json.Object members ->
    if List.assoc_opt "schema" members <> Some (Json.Text Statement.schema) then
      bad_input "%s: schema must be \"%s\": is this the right file?" path Statement.schema
  | _ -> bad_input "%s: is not a JSON object" path

let report (net : Network.t) (state : Claims.t) =
  let numbers = Printf.sprintf "%d spectral norms, %d upper bounds, %d lower bounds" state.spectral_norms state.upper_bounds state.lower_bounds in
  List.iter (fun what -> Printf.printf "not checked: %s\n" what) (List.rev state.not_checked);
  (match List.length state.not_checked with
   | 0 -> Printf.printf "accepted: every statement verified in exact arithmetic: %s\n" numbers
   | n -> Printf.printf "inconclusive: what was checked holds: %s; %d not checked\n" numbers n);
  Printf.printf "for %s\n" (Functions.words net);
  if state.not_checked = [] then 0 else 4

let run () =
  let empty = { Network.net = ""; phi = ""; rho = ""; key = ""; orders = [] } in
  let args, coq, positional = options empty false [] (List.tl (Array.to_list Sys.argv)) in
  let certificate, args = match positional with
    | [ c; net ] when args.phi = "" && args.rho = "" -> c, { args with net }
    | [ c ] when args.phi <> "" && args.rho <> "" -> c, args
    | _ -> raise (Usage "expected CERTIFICATE NET, or CERTIFICATE --phi FILE --rho FILE") in
  let json = Json.parse certificate (contents certificate) in
  schema_of certificate json;
  let net = Network.read args in
  let state = Certificate.check net json in
  if coq then begin
    print_string (Kernel.file state.parts (List.rev state.log));
    List.iter (fun what -> prerr_endline ("not checked: " ^ what)) (List.rev state.not_checked);
    if state.not_checked = [] then 0 else 4
  end
  else report net state

let () =
  let code = match run () with
    | code -> code
    | exception Rejected reason -> Printf.printf "rejected: %s\n" reason; 1
    | exception Usage reason -> Printf.eprintf "swarmcert-check-proved: %s\nTry --help\n" reason; 2
    | exception Bad_input reason -> Printf.eprintf "swarmcert-check-proved: %s\n" reason; 3
    | exception (Out_of_memory | Stack_overflow) -> prerr_endline "swarmcert-check-proved: the files are too large for this checker"; 3
    | exception fault -> Printf.eprintf "swarmcert-check-proved: internal fault: %s\n" (Printexc.to_string fault); 70 in
  exit code
