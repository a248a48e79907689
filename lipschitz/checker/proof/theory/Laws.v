(** An accepted law for several terms that move holds. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Claims Slopes.
Import ListNotations.
Open Scope R_scope.

Lemma same_box_eq x y : same_box x y = true -> x = y.
Proof.
  revert y. induction x as [|[a b] x IH]; intros [|[c d] y]; simpl; auto; try discriminate. intros H. do 2 both H.
  apply same_eq in H, H1. f_equal; [congruence|auto].
Qed.
Lemma same_moves_eq a b : same_moves a b = true -> a = b.
Proof.
  revert b. induction a as [|x a IH]; intros [|y b]; simpl; auto; try discriminate.
  intros H. both H. apply eqb_prop in H. f_equal; auto.
Qed.
Lemma find_slope_sound ps accepted phi rho moves u : Forall (holds ps) accepted ->
  find_slope accepted phi rho moves = Some u -> holds ps (Slope_at_most (Set_of phi rho) moves [] u).
Proof.
  intros H. revert u. induction H as [|c rest Hc H IH]; intros u; [discriminate|].
  destruct c as [| |[|q k] m [|] v| | | | | | | | | | | |]; simpl find_slope; auto.
  destruct (Nat.eqb_spec phi q), (Nat.eqb_spec rho k); cbn [andb]; try apply IH.
  destruct (same_moves moves m) eqn:E; [|apply IH]. apply same_moves_eq in E. subst.
  destruct (find_slope rest q k m) as [w|]; [destruct (at_most w v)|]; intros G; inversion G; subst;
      first [exact Hc | now apply IH].
Qed.
(** A term that moves: its bound, its values before and after, and how far it moves. *)
Record moving := Moving { bound : R; before : list R; after : list R; far : R }.
Lemma telescope (g : list R -> list R) n steps : (forall v, length (g v) = n) ->
  Forall (fun m => forall s, norm (minus (g (plusR (before m) s)) (g (plusR (after m) s))) <= bound m * far m) steps ->
  forall s, norm (minus (g (plusR (vector_sum (map before steps)) s)) (g (plusR (vector_sum (map after steps)) s)))
    <= dotR (map bound steps) (map far steps).
Proof.
  intros Hn H. induction H as [|m steps Hm H IH]; intros s; simpl.
  - unfold norm. rewrite square_minus_same, sqrt_0. lra.
  - rewrite (minus_through _ (g (plusR (plusR (after m) (vector_sum (map before steps))) s))) by now rewrite !Hn.
    eapply Rle_trans; [apply norm_plus|]. apply Rplus_le_compat; [rewrite !plus_assoc; apply Hm|].
    rewrite !(plus_comm (after m)), !plus_assoc. apply IH.
Qed.

Fixpoint steps_of (ps : list part) (cs : list dyadic) (groups : list (kind * list mover)) : list moving :=
  match cs, groups with
  | c :: cs', g :: groups' =>
      let v side m := value (part_at ps (fst (fst (fst g)))) (side m) in
      map (fun m => Moving (real c) (v fst m) (v snd m) (step_of m)) (snd g) ++ steps_of ps cs' groups'
  | _, _ => []
  end.
Definition not_negative (cs : list dyadic) (kinds : list kind) :=
  Forall2 (fun c (k : kind) => 0 <= real c /\ (0 <= snd k)%Z) cs kinds.
Definition bounds_of (ps : list part) (rho : nat) (cs : list dyadic) (kinds : list kind) :=
  Forall2 (fun c (k : kind) => holds ps (Slope_at_most (Set_of (fst (fst k)) rho) (snd (fst k)) [] c)) cs kinds.
Definition bounds_in (ps : list part) (rho : nat) (cs : list dyadic) (kinds : list (kind * box)) :=
  Forall2 (fun c (k : kind * box) =>
      holds ps (Slope_in_box (Set_of (fst (fst (fst k))) rho) (snd (fst (fst k))) [] (snd k) c)) cs kinds.
Lemma total_sound ps accepted squares kinds rho v : Forall (holds ps) accepted ->
  total_of accepted squares kinds rho = Some v -> exists cs, not_negative cs kinds /\ bounds_of ps rho cs kinds /\
  real v = fold_right Rplus 0 (map
      (fun ck : dyadic * kind => IZR (snd (snd ck)) * (if squares then
      real (fst ck) * real (fst ck) else real (fst ck))) (combine cs kinds)).
Proof.
  intros HA. revert v. induction kinds as [|[[phi moves] n] kinds IH]; intros v; simpl.
  - intros H. inversion H. exists []. split; [constructor|]. split; [constructor|]. apply real_zero.
  - destruct (find_slope accepted phi rho moves) as [k|] eqn:Hk; [|discriminate].
    destruct (total_of accepted squares kinds rho) as [w|] eqn:Hw; [|discriminate].
    destruct (is_nonnegative k) eqn:Kn; [|discriminate]. destruct (Z.leb_spec 0 n); [|discriminate]. simpl.
    intros G. inversion G. destruct (IH w eq_refl) as (cs & P & B & E). exists (k :: cs). split; [|split].
    + constructor; auto. simpl. split; auto. now apply real_nonnegative.
    + constructor; auto. now apply (find_slope_sound ps accepted).
    + rewrite real_add, real_mul, E. simpl. f_equal. replace (real (n, 0%Z)) with (IZR n) by (unfold real; simpl; ring).
      destruct squares; auto. now rewrite real_mul.
Qed.
Lemma steps_values ps cs kinds movers : length cs = length kinds ->
  flat_map (terms ps fst) (combine kinds movers) = map before (steps_of ps cs (combine kinds movers)) /\
  flat_map (terms ps snd) (combine kinds movers) = map after (steps_of ps cs (combine kinds movers)).
Proof.
  revert cs movers. induction kinds as [|k kinds IH]; intros [|c cs] [|ms movers]; simpl; try discriminate; auto.
  intros H. destruct (IH cs movers ltac:(lia)) as [-> ->]. rewrite !map_app, !map_map. auto.
Qed.
Lemma steps_far ps cs kinds movers : length cs = length kinds -> length movers = length kinds ->
  map far (steps_of ps cs (combine kinds movers)) = map step_of (concat movers).
Proof.
  revert cs movers. induction kinds as [|k kinds IH]; intros [|c cs] [|ms movers]; simpl; try discriminate; auto.
  intros H G. rewrite !map_app, !map_map, IH by lia. reflexivity.
Qed.
Lemma steps_hold ps rho cs kinds movers : bounds_of ps rho cs kinds -> Forall2 may_move kinds movers ->
  Forall (fun g => Forall (fun m => length (fst m) = inputs_of (part_at ps (fst (fst (fst g))))) (snd g))
      (combine kinds movers) ->
  Forall (fun m => forall s,
      norm (minus (value (part_at ps rho) (plusR (before m) s)) (value (part_at ps rho) (plusR (after m) s)))
    <= bound m * far m) (steps_of ps cs (combine kinds movers)).
Proof.
  intros H. revert movers. induction H as [|c k cs kinds Hk H IH]; intros movers M L; [constructor|].
  inversion M as [|? ms ? movers' [Hcount Hms] M']; subst. simpl in *. inversion L as [|? ? Lk L']; subst. simpl in Lk.
  apply Forall_app. split; auto. apply Forall_map, Forall_forall. intros m Hm s. simpl.
  rewrite Forall_forall in Hms, Lk. pose proof (Hk s (fst m) (snd m) (Hms _ Hm) (Lk _ Hm)) as B.
  unfold distance in B. rewrite square_in_one in B. exact B.
Qed.
Lemma dot_constants (c : R) (f : mover -> R) ms : dotR (map (fun _ => c) ms) (map f ms) =
    c * dotR (map (fun _ => 1) ms) (map f ms).
Proof. induction ms as [|m ms IH]; simpl; [ring|]. rewrite IH. ring. Qed.
Lemma dot_counted (f : mover -> R) r ms : 0 <= r -> Forall (fun m => f m <= r) ms ->
  dotR (map (fun _ => 1) ms) (map f ms) <= INR (length ms) * r.
Proof.
  intros Hr H. induction H as [|m ms Hm H IH]; [simpl; lra|]. cbn [map length dot]. rewrite S_INR. lra.
Qed.
(** No more than stated. *)
Definition few (k : kind) (ms : list mover) : Prop := (Z.of_nat (length ms) <= snd k)%Z.
Lemma counted ms (k : kind) : few k ms -> INR (length ms) <= IZR (snd k).
Proof. intros H. rewrite INR_IZR_INZ. now apply IZR_le. Qed.
Lemma sum_of_steps (ps : list part) cs kinds movers r : 0 <= r -> not_negative cs kinds ->
  Forall2 few kinds movers -> Forall (fun m => step_of m <= r) (concat movers) ->
  dotR (map bound (steps_of ps cs (combine kinds movers))) (map far (steps_of ps cs (combine kinds movers))) <=
  fold_right Rplus 0 (map (fun ck : dyadic * kind => IZR (snd (snd ck)) * real (fst ck)) (combine cs kinds)) * r.
Proof.
  intros Hr H. revert movers. induction H as [|c k cs kinds (Hc & Hn) H IH]; intros movers M L; [simpl; lra|].
  inversion M as [|? ms ? movers' Hk M']; subst. simpl in L. apply Forall_app in L. destruct L as [L L'].
  simpl. rewrite !map_app, !map_map. rewrite dot_app by (now rewrite !map_length). simpl.
  specialize (IH _ M' L'). pose proof (dot_constants (real c) step_of ms) as D.
  pose proof (dot_counted step_of r ms Hr L) as B. pose proof (counted _ _ Hk) as N.
  pose proof (Rmult_le_compat_r r _ _ Hr N) as N'.
  pose proof (Rmult_le_compat_l (real c) _ _ Hc (Rle_trans _ _ _ B N')) as P.
  rewrite Rmult_plus_distr_r. apply Rplus_le_compat; [|exact IH]. eapply Rle_trans; [apply Req_le; exact D|]. lra.
Qed.
Lemma square_of_bounds (ps : list part) cs kinds movers : not_negative cs kinds -> Forall2 few kinds movers ->
  square (map bound (steps_of ps cs (combine kinds movers))) <=
  fold_right Rplus 0 (map (fun ck : dyadic * kind => IZR (snd (snd ck)) * (real (fst ck) * real (fst ck)))
      (combine cs kinds)).
Proof.
  unfold square. intros H. revert movers. induction H as [|c k cs kinds (Hc & Hn) H IH]; intros movers M;
      [simpl; lra|].
  inversion M as [|? ms ? movers' Hk M']; subst. simpl. rewrite map_app, map_map, dot_app by reflexivity. simpl.
  specialize (IH _ M'). pose proof (dot_constants (real c) (fun _ => real c) ms) as D.
  pose proof (dot_counted (fun _ => real c) (real c) ms Hc) as B.
  assert (Forall (fun _ : mover => real c <= real c) ms) as F by (apply Forall_forall; intros; lra). specialize (B F).
  pose proof (counted _ _ Hk) as N. pose proof (Rmult_le_compat_r (real c) _ _ Hc N) as N'.
  pose proof (Rmult_le_compat_l (real c) _ _ Hc (Rle_trans _ _ _ B N')) as P.
  apply Rplus_le_compat; [|exact IH]. eapply Rle_trans; [apply Req_le; exact D|]. lra.
Qed.
Lemma Forall2_lengths {A B} (P : A -> B -> Prop) a b : Forall2 P a b -> length a = length b.
Proof. intros H. induction H; simpl; auto. Qed.
Lemma law_of_sums ps cs kinds movers (stacked : bool) u v change : 0 <= real u -> not_negative cs kinds ->
  Forall2 few kinds movers ->
  let steps := steps_of ps cs (combine kinds movers) in
  norm change <= dotR (map bound steps) (map far steps) ->
  real v = fold_right Rplus 0 (map
      (fun ck : dyadic * kind => IZR (snd (snd ck)) * (if stacked then
      real (fst ck) * real (fst ck) else real (fst ck))) (combine cs kinds)) ->
  real v <= real (if stacked then mul u u else u) -> bounded_change stacked u change (concat movers).
Proof.
  intros H B M steps T E Ht. unfold steps in T. clear steps. pose proof (Forall2_lengths _ _ _ B) as Lc.
  pose proof (Forall2_lengths _ _ _ M) as Lm. destruct stacked; simpl.
  - eapply Rle_trans; [exact T|]. eapply Rle_trans; [apply cauchy|]. rewrite steps_far by auto.
    apply Rmult_le_compat_r; [apply norm_nonneg|]. apply sqrt_below; auto. rewrite real_mul in Ht.
    pose proof (square_of_bounds ps cs kinds movers B M). lra.
  - intros r Hr F. eapply Rle_trans; [exact T|].
    eapply Rle_trans; [apply (sum_of_steps ps cs kinds movers r Hr B M F)|]. apply Rmult_le_compat_r; auto. lra.
Qed.
Lemma law_of_steps ps rho cs kinds movers (stacked : bool) u v : 0 <= real u ->
  not_negative cs kinds -> Forall2 may_move kinds movers ->
  let steps := steps_of ps cs (combine kinds movers) in
  norm (minus (value (part_at ps rho) (vector_sum (map before steps)))
    (value (part_at ps rho) (vector_sum (map after steps)))) <= dotR (map bound steps) (map far steps) ->
  real v = fold_right Rplus 0 (map
      (fun ck : dyadic * kind => IZR (snd (snd ck)) * (if stacked then
      real (fst ck) * real (fst ck) else real (fst ck))) (combine cs kinds)) ->
  real v <= real (if stacked then mul u u else u) -> let groups := combine kinds movers in
  bounded_change stacked u (minus (value (part_at ps rho) (sum_at ps fst groups))
    (value (part_at ps rho) (sum_at ps snd groups))) (concat movers).
Proof.
  intros H B M steps T E Ht. unfold steps in T. clear steps. cbv zeta. unfold sum_at.
  destruct (steps_values ps cs kinds movers (Forall2_lengths _ _ _ B)) as [-> ->].
  apply law_of_sums with (cs := cs) (v := v) (ps := ps) (kinds := kinds); auto.
  clear - M. induction M as [|k ms kinds movers [N _] M IH]; constructor; auto.
Qed.
Lemma telescope_all ps rho steps : fits_part (part_at ps rho) = true -> Forall (fun m => forall s,
      norm (minus (value (part_at ps rho) (plusR (before m) s)) (value (part_at ps rho) (plusR (after m) s)))
    <= bound m * far m) steps ->
  norm (minus (value (part_at ps rho) (vector_sum (map before steps)))
    (value (part_at ps rho) (vector_sum (map after steps)))) <= dotR (map bound steps) (map far steps).
Proof.
  intros Hf S. pose proof (telescope (value (part_at ps rho)) _ _ (fun x => length_value _ x Hf) S []) as T.
  now rewrite !plus_nil_r in T.
Qed.
Lemma law_sound ps accepted stacked kinds rho u : Forall (holds ps) accepted ->
  check_law ps accepted stacked kinds rho u = true -> holds ps (Law stacked kinds rho u).
Proof.
  intros HA. unfold check_law. intros H. do 2 both H. rename H0 into Ht, H1 into Hf. apply real_nonnegative in H.
  destruct (total_of accepted stacked kinds rho) as [v|] eqn:Ev; [|discriminate]. apply at_most_real in Ht.
  destruct (total_sound _ _ _ _ _ _ HA Ev) as (cs & P & B & E). simpl holds. intros movers M L.
  apply law_of_steps with (cs := cs) (v := v); auto. apply telescope_all; auto. apply (steps_hold ps rho cs kinds
    movers B M L).
Qed.

(** In a box *)
Lemma find_slope_in_sound ps accepted phi rho moves b u : Forall (holds ps) accepted ->
  find_slope_in accepted phi rho moves b = Some u -> holds ps (Slope_in_box (Set_of phi rho) moves [] b u).
Proof.
  intros H. revert u. induction H as [|c rest Hc H IH]; intros u; [discriminate|].
  destruct c as [| |[|q k] m [|] v| |[|q k] m [|] d v| | | | | | | | | |]; simpl find_slope_in; auto.
  - destruct (Nat.eqb_spec phi q), (Nat.eqb_spec rho k); cbn [andb]; try apply IH.
    destruct (same_moves moves m) eqn:E; [|apply IH]. apply same_moves_eq in E. subst.
    assert (holds ps (Slope_in_box (Set_of q k) m [] b v)) as Hv by (intros r x y A L _ _; now apply Hc).
    unfold less_of. destruct (find_slope_in rest q k m b) as [w|]; [destruct (at_most w v)|];
      intros G; inversion G; subst; first [exact Hv | now apply IH].
  - destruct (Nat.eqb_spec phi q), (Nat.eqb_spec rho k); cbn [andb]; try apply IH.
    destruct (same_moves moves m) eqn:E; cbn [andb]; [|apply IH]. apply same_moves_eq in E.
    destruct (same_box b d) eqn:F; [|apply IH]. apply same_box_eq in F. subst.
    unfold less_of. destruct (find_slope_in rest q k m d) as [w|]; [destruct (at_most w v)|];
      intros G; inversion G; subst; first [exact Hc | now apply IH].
Qed.
Lemma total_in_sound ps accepted squares kinds rho v : Forall (holds ps) accepted ->
  total_in accepted squares kinds rho = Some v -> exists cs,
  not_negative cs (map fst kinds) /\ bounds_in ps rho cs kinds /\
  real v = fold_right Rplus 0 (map
      (fun ck : dyadic * kind => IZR (snd (snd ck)) * (if squares then
      real (fst ck) * real (fst ck) else real (fst ck))) (combine cs (map fst kinds))).
Proof.
  intros HA. revert v. induction kinds as [|[[[phi moves] n] b] kinds IH]; intros v; simpl.
  - intros H. inversion H. exists []. split; [constructor|]. split; [constructor|]. apply real_zero.
  - destruct (find_slope_in accepted phi rho moves b) as [k|] eqn:Hk; [|discriminate].
    destruct (total_in accepted squares kinds rho) as [w|] eqn:Hw; [|discriminate].
    destruct (is_nonnegative k) eqn:Kn; [|discriminate]. destruct (Z.leb_spec 0 n); [|discriminate]. simpl.
    intros G. inversion G. destruct (IH w eq_refl) as (cs & P & B & E). exists (k :: cs). split; [|split].
    + constructor; auto. simpl. split; auto. now apply real_nonnegative.
    + constructor; auto. now apply (find_slope_in_sound ps accepted).
    + rewrite real_add, real_mul, E. simpl. f_equal. replace (real (n, 0%Z)) with (IZR n) by (unfold real; simpl; ring).
      destruct squares; auto. now rewrite real_mul.
Qed.
Lemma steps_in_box_hold ps rho cs kinds movers : bounds_in ps rho cs kinds -> Forall2 may_move (map fst kinds) movers ->
  Forall2 (fun k => Forall (fun m => within (snd k) (fst m) /\ within (snd k) (snd m))) kinds movers ->
  Forall (fun g => Forall (fun m => length (fst m) = inputs_of (part_at ps (fst (fst (fst g))))) (snd g))
      (combine (map fst kinds) movers) ->
  Forall (fun m => forall s,
      norm (minus (value (part_at ps rho) (plusR (before m) s)) (value (part_at ps rho) (plusR (after m) s)))
    <= bound m * far m) (steps_of ps cs (combine (map fst kinds) movers)).
Proof.
  intros H. revert movers. induction H as [|c [k b] cs kinds Hk H IH]; intros movers M W L; [constructor|]. simpl in M.
  inversion M as [|? ms ? movers' [Hcount Hms] M']; subst. inversion W as [|? ? ? ? Hw W']; subst. simpl in *.
  inversion L as [|? ? Lk L']; subst. simpl in Lk.
  apply Forall_app. split; auto. apply Forall_map, Forall_forall. intros m Hm s. simpl.
  rewrite Forall_forall in Hms, Lk, Hw. destruct (Hw _ Hm) as [W1 W2].
  pose proof (Hk s (fst m) (snd m) (Hms _ Hm) (Lk _ Hm) W1 W2) as B.
  unfold distance in B. rewrite square_in_one in B. exact B.
Qed.
Lemma law_in_box_sound ps accepted stacked kinds rho u : Forall (holds ps) accepted ->
  check_law_in_box ps accepted stacked kinds rho u = true -> holds ps (Law_in_box stacked kinds rho u).
Proof.
  intros HA. unfold check_law_in_box. intros H. do 2 both H. rename H0 into Ht, H1 into Hf. apply real_nonnegative in H.
  destruct (total_in accepted stacked kinds rho) as [v|] eqn:Ev; [|discriminate]. apply at_most_real in Ht.
  destruct (total_in_sound _ _ _ _ _ _ HA Ev) as (cs & P & B & E). simpl holds. intros movers M W L.
  apply law_of_steps with (cs := cs) (v := v); auto. apply telescope_all; auto. apply (steps_in_box_hold ps rho cs
    kinds movers B M W L).
Qed.
